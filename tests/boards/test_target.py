"""A program of tests/boards/target on the machine it was built for, in its simulator.

    test_target.py COMMAND...                       runs it: it passes when it ends with 0
    test_target.py --same-as PROGRAM COMMAND...     and when it says, byte for byte, what PROGRAM says here
"""
import subprocess
import sys


def main():
    arguments = sys.argv[1:]
    here = None
    if arguments[0] == "--same-as":
        here = subprocess.run([arguments[1]], stdout=subprocess.PIPE, check=True).stdout
        arguments = arguments[2:]
    done = subprocess.run(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=800)
    said = done.stdout + done.stderr  # QEMU's semihosting talks on stderr
    if here is not None:
        lines = [line for line in said.splitlines() if not line.startswith(b"avr_board: ")]
        for number, (ours, theirs) in enumerate(zip(here.splitlines(), lines), 1):
            if ours != theirs:
                sys.exit(f"line {number}: here {ours!r}, there {theirs!r}")
        if len(lines) != len(here.splitlines()) or not lines:
            sys.exit(f"here {len(here.splitlines())} lines, there {len(lines)}")
        print(f"{len(lines)} lines, the same")
    elif done.returncode or b"FAIL" in said or b" 0 Failures" not in said:
        sys.stdout.write(said.decode(errors="replace"))
        sys.exit(f"{' '.join(arguments)} ended with {done.returncode}")
    if done.returncode:
        sys.exit(done.returncode)


if __name__ == "__main__":
    main()
