"""What the boards cost: flash, RAM and stack of each image, the core's part in it module by module, and the work of the
core's calls in cycles (AVR, simavr) and instructions (Cortex-M3, QEMU). All of it is counted, nothing timed.

    figures.py BUILDS --avr-board PROGRAM --qemu PROGRAM [--report FILE] [--update]

Compares with figures.txt beside this file: no figure may be more than 3 % above it (stack seen: 20 %). --update writes
what was measured: commit it with the change that is the reason, and say why. BUILDS holds one build directory for each board.
"""
import argparse
import re
import subprocess
import sys
from pathlib import Path

COMMITTED = Path(__file__).with_name("figures.txt")
MARGIN = 1.03
MARGIN_STACK_SEEN = 1.2  # an interrupt comes at the deepest call, or not
KINDS = ("trio", "mpc")
WITH_HANDS = ("trio", "mpc", "trio-hands", "mpc-hands")
IMAGES = [("avr-uno", "uno", "atmega328p", WITH_HANDS), ("avr-mega", "mega", "atmega2560", WITH_HANDS),
          ("avr-leonardo", "leonardo", "atmega32u4", WITH_HANDS), ("cortex-m", "cortex-m", None, KINDS),
          ("cortex-m0plus", "cortex-m", None, KINDS)]
# Everything that nests deeply: calibration, a move, a stream, a stop, a calibration of an MPC-200, memory. By hand: a home,
# a pause of it or a stop, a detent of knob X, one along the diagonal.
SCENARIO = {
    "trio": "2500000 63\n2600000 48 00 00 00 00 00 00 00 00 00 00 00 00\n3300000 52\n3400000 63 63\n4300000 77\n"
            "4400000 53 00 ff ff 03 00 ff ff 03 00 ff ff 03 00\n4600000 63\n4700000 03\n7000000 stop\n",
    "mpc": "2500000 55\n2510000 4f\n2520000 53\n2560000 0f\n2600000 80 3e 00 00 40 1f 00 00 10 00 00 00\n2700000 43 43 03\n"
           "2800000 4d 00 10 00 00 00 20 00 00 00 30 00 00\n4800000 48\n5900000 4e\n8500000 stop\n",
    "trio-hands": "2500000 63\n2600000 low HOME\n2650000 open HOME\n2700000 low HOME\n2750000 open HOME\n"
                  "2900000 low HOME\n2950000 open HOME\n3600000 low THIRD\n3700000 open THIRD\n3800000 low A\n"
                  "3810000 low B\n3820000 open A\n3830000 open B\n4500000 53 00 ff ff 03 00 ff ff 03 00 ff ff 03 00\n"
                  "4700000 03\n6500000 stop\n",
    "mpc-hands": "2500000 4f\n2520000 53\n2560000 0f\n2600000 80 3e 00 00 40 1f 00 00 10 00 00 00\n2700000 low THIRD\n"
                 "2750000 open THIRD\n2800000 low FOURTH\n2850000 open FOURTH\n2900000 low A\n2910000 low B\n2920000 open A\n"
                 "2930000 open B\n3000000 low HOME\n3050000 open HOME\n4500000 low FIFTH\n4550000 open FIFTH\n7500000 stop\n",
}
# Buttons 1, 3, 4, 5 and the contacts of knob Z by the pins of the chip: tests/boards/test_avr_hands.py.
PINS = {"uno": {"HOME": "D6", "THIRD": "B0", "FOURTH": "B1", "FIFTH": "B2", "A": "C4", "B": "C5"},
        "mega": {"HOME": "H3", "THIRD": "H5", "FOURTH": "H6", "FIFTH": "B4", "A": "F4", "B": "F5"},
        "leonardo": {"HOME": "D7", "THIRD": "B4", "FOURTH": "B5", "FIFTH": "B6", "A": "F1", "B": "F0"}}


def scenario(kind, board):
    return re.sub("(low|open) (\\w+)", lambda found: f"{found[1]} {PINS[board][found[2]]}", SCENARIO[kind])


def run(*command, text=None):
    done = subprocess.run([str(part) for part in command], input=text, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"figures: {command[0]} failed:\n{done.stderr}")
    return done.stdout + done.stderr


def sections(tool, elf):
    """Flash and static RAM, bytes."""
    text, data, bss = map(int, run(f"{tool}-size", elf).splitlines()[1].split()[:3])
    return text + data, data + bss


def modules(map_file):
    """What each module of the core, and the compiler's own arithmetic, is of the image: bytes."""
    text = map_file.read_text().split("Linker script and memory map", 1)[1]
    found = {}
    # " .text.name  0xaddress  0xsize path", the name on a line of its own when it is long
    for section, size, path in re.findall(r"^ (\.(?:text|rodata|progmem|data)\S*)\s+0x[0-9a-f]+\s+0x([0-9a-f]+) (\S+)$", text, re.M):
        name = re.search(r"\((dr_\w+)\.c\.obj\)|(libgcc)\.a\(", path)
        if name:
            name = name.group(1) or name.group(2)
            found[name] = found.get(name, 0) + int(size, 16)
    return found


def deepest_chain(tool, elf, build, root, return_bytes):
    """A bound on the stack below a function, from what the compiler says of each frame (-fstack-usage) and from the calls
    in the image. Functions in assembler count 8 bytes; calls through pointers (Arduino's classes) are not followed."""
    frames = {}
    for file in build.rglob("*.su"):
        for line in file.read_text().splitlines():
            where, size, _ = line.split("\t")
            name = where.rsplit(":", 1)[1]
            frames[name] = max(frames.get(name, 0), int(size))
    calls, current = {}, None
    for line in run(f"{tool}-objdump", "-d", "--no-show-raw-insn", elf).splitlines():
        if found := re.match(r"[0-9a-f]+ <(.+)>:$", line):
            current = found.group(1)
            calls[current] = set()
        elif found := re.search(r"\t(?:r?call|r?jmp|bl|b|b\.n|b\.w)\b.*<([^+>]+)>", line):
            if found.group(1) != current:
                calls[current].add(found.group(1))
    depths = {}

    def depth(name, above):
        if name in above or name.startswith(("__prologue", "__epilogue")):
            return 0
        if name not in depths:
            plain = re.sub(r"\.(isra|part|constprop|lto_priv)\.\d+", "", name)
            own = frames.get(name, frames.get(plain, 8))
            depths[name] = own + return_bytes + max((depth(called, above | {name}) for called in calls.get(name, ())), default=0)
        return depths[name]

    return depth(root, frozenset())


def measure(arguments):
    rows = {}
    for build, board, mcu, kinds in IMAGES:
        directory = Path(arguments.builds, build)
        tool = "avr" if mcu else "arm-none-eabi"
        for kind in kinds:
            elf = directory / f"{board}-{kind}.elf"
            rows[f"{build}-{kind} flash"], rows[f"{build}-{kind} static-RAM"] = sections(tool, elf)
            if mcu:
                said = run(arguments.avr_board, *(["--usb"] if board == "leonardo" else []), "--script", "-", mcu, elf,
                           text=scenario(kind, board))
                rows[f"{build}-{kind} stack-seen"] = int(re.search(r"stack (\d+) bytes", said).group(1))
        if build in ("avr-uno", "cortex-m0plus"):
            parts = modules(directory / f"{board}-mpc.map")
            core = {name: size for name, size in parts.items() if name != "libgcc"}
            for name, size in sorted(core.items()):
                rows[f"{build} linked {name}"] = size
            rows[f"{build} linked core-together"] = sum(core.values())
            rows[f"{build} linked libgcc"] = parts.get("libgcc", 0)
            rows[f"{build} stack-bound dr_emulator_step"] = deepest_chain(
                tool, directory / f"{board}-mpc.elf", directory, "dr_emulator_step", 2 if mcu else 0)
            for struct, symbol, count in (("dr_controller", "controller", 1), ("dr_drive", "drives", 4)):
                size = re.search(rf"^\S+ (\S+) b {symbol}$", run(f"{tool}-nm", "-S", directory / f"{board}-mpc.elf"), re.M)
                rows[f"{build} sizeof {struct}"] = int(size.group(1), 16) // count
    for build, board in (("avr-mega", "mega"), ("cortex-m", "cortex-m")):
        directory = Path(arguments.builds, build)
        tool = "avr" if board == "mega" else "arm-none-eabi"
        elf = directory / f"{board}-bridge.elf"
        rows[f"{build}-bridge flash"], rows[f"{build}-bridge static-RAM"] = sections(tool, elf)
        for root in ("dr_bridge_begin", "dr_bridge_step"):
            rows[f"{build}-bridge stack-bound {root}"] = deepest_chain(tool, elf, directory, root, 2 if tool == "avr" else 0)
    qemu = [arguments.qemu, *"-M mps2-an385 -display none -monitor none -serial null -icount shift=10".split(),
            "-semihosting-config", "enable=on,target=native", "-kernel"]
    for program in ("costs", "guard_costs"):
        cycles = run(arguments.avr_board, "--program", "atmega2560", Path(arguments.builds, f"avr-mega/target-{program}.elf"))
        instructions = run(*qemu, Path(arguments.builds, f"cortex-m/target-{program}.elf"))
        for unit, said in (("cycles", cycles), ("instructions", instructions)):
            for name, work in re.findall(r"^((?:push|pull|due|guard)\S*) (\d+)$", said, re.M):
                rows[f"{unit} {name}"] = int(work)
    return rows


def main():
    parser = argparse.ArgumentParser(description="What the boards cost.")
    parser.add_argument("builds")
    parser.add_argument("--avr-board", required=True)
    parser.add_argument("--qemu", required=True)
    parser.add_argument("--report", type=Path)
    parser.add_argument("--update", action="store_true")
    arguments = parser.parse_args()
    measured = measure(arguments)
    table = "".join(f"{name:<44} {value:>7}\n" for name, value in measured.items())
    if arguments.update:
        COMMITTED.write_text(table)
        return 0
    committed = {line[:44].rstrip(): int(line[44:]) for line in COMMITTED.read_text().splitlines()}
    problems = []
    for name in sorted(measured.keys() | committed.keys()):
        is_now, was = measured.get(name), committed.get(name)
        if is_now is None or was is None:
            problems.append(f"{name}: {'not measured any more' if is_now is None else 'not in figures.txt'}")
        elif is_now > was * (MARGIN_STACK_SEEN if name.endswith("stack-seen") else MARGIN):
            problems.append(f"{name}: {is_now}, committed {was}")
    if arguments.report:
        arguments.report.parent.mkdir(exist_ok=True)
        arguments.report.write_text("Boards: bytes, cycles (16 MHz AVR) and instructions (Cortex-M3)\n" + table)
    if problems:
        print("\n".join(problems))
        print("If this is meant, run this again with --update and commit figures.txt with the reason.")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
