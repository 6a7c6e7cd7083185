"""The guard as a Cortex-M image in QEMU, between this test or `dryrig` and dryrig-emu. QEMU counts instructions (-icount), so its
clock goes on only as the guard works: a busy computer makes it slow and not wrong. Times are in test_bridge_avr.py.

    test_bridge_cortex_m.py QEMU IMAGE DRYRIG_GUARD DRYRIG_EMU DRYRIG
"""
import re
import socket
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import realtime
from images import point

QEMU, IMAGE, GUARD, EMULATOR, DRYRIG = (sys.argv.pop(1) for _ in range(5))
PATIENCE_S = 60
STOP, STOP_2, KEY, ARM, CONFIRM, HOST = 1, 2, 4, 8, 1 << 8, 1 << 9  # inputs of bridge_port.h
AT_REST = STOP | STOP_2 | KEY | HOST
HERE = point(20000, 20000, 20000)
CONFIGURATION = """format = 1; revision = %d; profile = "trio-mp245a"; firmware = "3.12";
    external_switch5_on = true; external_switch6_on = false;
    drives = ({ number = 1; device = "MP-845"; microstep_um = 0.09375; max_move_um = 24000;
                box_um = { x = (100, 24900); y = (100, 24900); z = (100, 20000); }; });"""


def compiled(revision=7):
    with tempfile.TemporaryDirectory() as temporary:
        text, image = Path(temporary, "rig.conf"), Path(temporary, "rig.bin")
        text.write_text(CONFIGURATION % revision)
        subprocess.run([GUARD, "compile", text, "-o", image], check=True, stdout=subprocess.PIPE)
        return image.read_bytes()


def until(what, said):
    end = time.monotonic() + PATIENCE_S
    while not (result := what()):
        if time.monotonic() > end:
            raise AssertionError(f"waited in vain for {said}")
        time.sleep(0.02)
    return result


class Rig:
    """dryrig-emu, the guard in QEMU, and what people do. The host's line is a pseudo-terminal, or a socket."""

    def __init__(self, case, first=b"", second=b"", host_pty=False):
        temporary = tempfile.TemporaryDirectory()
        case.addCleanup(temporary.cleanup)
        self.directory = Path(temporary.name)
        at = self.path
        self.emulator = subprocess.Popen([EMULATOR, "trio", "--link", at("device"), "--position", "20000,20000,20000",
                                          "--trace", at("trace")], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        case.addCleanup(self.end, self.emulator)
        self.emulator.stdout.readline()
        loaded = []
        for number, image in enumerate((first, second)):
            if image:
                self.directory.joinpath(f"limits{number}").write_bytes(image)
                loaded += ["-device", f"loader,file={at(f'limits{number}')},addr={0x380000 + 0x1000 * number:#x},force-raw=on"]
        host = "pty,id=host" if host_pty else f"socket,id=host,path={at('host')},server=on,wait=off"
        said = open(at("said"), "wb")
        case.addCleanup(said.close)
        self.qemu = subprocess.Popen(
            [QEMU, *"-M mps2-an385 -display none -monitor none -icount shift=3".split(),
             "-gdb", f"unix:{at('gdb')},server=on,wait=off",
             "-chardev", host, "-serial", "chardev:host",
             "-chardev", f"serial,id=device,path={at('device')}", "-serial", "chardev:device",
             "-chardev", f"file,id=log,path={at('log')}", "-serial", "chardev:log",
             "-chardev", f"socket,id=pins,path={at('pins')},server=on,wait=off", "-serial", "chardev:pins",
             *loaded, "-kernel", IMAGE], stdout=said, stderr=subprocess.STDOUT)
        case.addCleanup(self.end, self.qemu)
        self.people = self.connect("pins")
        case.addCleanup(self.people.close)
        self.close_inputs(AT_REST)
        if host_pty:
            self.port = until(lambda: re.search(r"/dev/pts/\d+", self.directory.joinpath("said").read_text()), "QEMU's port").group(0)
        else:
            self.host = self.connect("host")
            case.addCleanup(self.host.close)

    def path(self, name):
        return str(self.directory / name)

    @staticmethod
    def end(process):
        process.kill()
        process.communicate()

    def connect(self, name):
        line = socket.socket(socket.AF_UNIX)
        line.settimeout(PATIENCE_S)

        def is_there():
            try:
                line.connect(self.path(name))
                return True
            except (FileNotFoundError, ConnectionRefusedError):
                return False

        until(is_there, name)
        return line

    def close_inputs(self, mask):
        self.people.sendall(bytes([mask & 0x7F, 0x80 | mask >> 7]))

    def log(self):
        lines = self.directory.joinpath("log").read_text().splitlines() if self.directory.joinpath("log").exists() else []
        records = [line.rpartition("#")[2] for line in lines]
        return [bytes.fromhex(record) for record in records if len(record) == 96]

    def records(self, event):
        return [record for record in self.log() if record[8] == event]

    def state(self):
        """dr_guard_state after the last record."""
        log = self.log()
        return log[-1][10] if log else None

    def wait_for_state(self, *states):
        until(lambda: self.state() in states, f"state {states}")

    def arm(self):
        self.wait_for_state(DISARMED)
        self.close_inputs(AT_REST | ARM)
        self.wait_for_state(IDLE)
        self.close_inputs(AT_REST)

    def ask(self, said, count):
        self.host.sendall(said)
        got = b""
        while len(got) < count:
            more = self.host.recv(count - len(got))
            if not more:
                break
            got += more
        return got

    def controller_got(self):
        """Since the last call, by the emulator's trace."""
        lines = self.directory.joinpath("trace").read_text().splitlines()
        new, self.seen = lines[getattr(self, "seen", 0):], len(lines)
        return b"".join(bytes.fromhex(re.match(r"\s*\S+ > ((?:[0-9A-F]{2} )+)", line).group(1)) for line in new if " > " in line[:20])

    def start_slow_move(self):
        """And forgets what the controller has got until then."""
        def runs():
            return self.directory.joinpath("trace").read_text().count(" - runs to ")

        before = runs()
        self.host.sendall(SLOW)
        until(lambda: runs() > before, "the move")
        self.controller_got()

    def flip(self, pattern):
        """Flips a bit in memory where these bytes are found first, by QEMU's debugger port, which stands still meanwhile."""
        waiting = b""

        def packet():
            nonlocal waiting
            while not (found := re.search(rb"\$([^#]*)#..", waiting, re.DOTALL)):
                more = line.recv(65536)
                assert more, "the debugger's port has closed"
                waiting += more
            line.sendall(b"+")
            waiting = waiting[found.end():]
            return found.group(1)

        def command(text):
            line.sendall(b"$" + text + b"#%02x" % (sum(text) & 0xFF))
            while (answer := packet())[:1] in b"ST":  # stop reports come unasked as well
                pass
            return answer

        with self.connect("gdb") as line:
            memory = b"".join(bytes.fromhex(command(b"m%x,400" % at).decode()) for at in range(0x20000000, 0x20002000, 0x400))
            at = 0x20000000 + memory.index(pattern)
            assert command(b"M%x,1:%02x" % (at, pattern[0] ^ 1)) == b"OK"
            assert command(b"D") == b"OK"


LOCKED, DISARMED, IDLE, FAULT, STOPPED = 0, 1, 2, 7, 8  # dr_guard_state
START, REFUSED = 0, 3  # dr_event


def line(level, x, y, z):
    return b"S" + bytes([level]) + point(x, y, z)


SLOW = line(0, 250000, 20000, 20000)  # 21,562.5 um at 312.5 um/s: 69 s


class Bridge(realtime.TestCase):
    def test_proof_queries_refusal_and_an_allowed_move(self):
        rig = Rig(self, compiled())
        rig.wait_for_state(DISARMED)
        self.assertLessEqual(set(rig.controller_got()), set(b"\x03c"))  # STOP may have been open for a moment
        self.assertEqual(rig.ask(b"c", 14), HERE + b"\x1e\r")
        move = line(15, 20256, 20003, 20013)
        rig.host.sendall(move)
        until(lambda: rig.records(REFUSED), "the refusal")
        rig.arm()
        rig.controller_got()
        self.assertEqual(rig.ask(move, 1), b"\r")
        until(lambda: rig.state() == IDLE, "the end")
        self.assertEqual(rig.controller_got(), b"c" + move + b"c")
        rig.host.sendall(line(15, 20256, 20003, 500))  # beyond the box
        until(lambda: len(rig.records(REFUSED)) == 2, "the refusal")
        self.assertEqual(rig.ask(b"c", 14), move[2:] + b"\x1e\r")
        self.assertEqual(rig.controller_got(), b"cc")

    def test_interrupt_and_stop_contacts(self):
        rig = Rig(self, compiled())
        rig.arm()
        rig.start_slow_move()
        self.assertEqual(rig.ask(b"\x03", 1), b"\r")
        self.assertEqual(rig.controller_got(), b"\x03cc")
        rig.start_slow_move()
        rig.close_inputs(AT_REST & ~STOP_2)
        rig.wait_for_state(STOPPED, FAULT)  # the other contact is closed
        rig.close_inputs(AT_REST)
        rig.host.sendall(SLOW)
        until(lambda: len(rig.records(REFUSED)) == 1, "the refusal")
        self.assertEqual(rig.controller_got(), b"\x03cc")

    def test_the_older_configuration_wants_to_be_confirmed(self):
        damaged = bytearray(compiled(8))
        damaged[100] ^= 1
        rig = Rig(self, bytes(damaged), compiled(7))
        rig.wait_for_state(DISARMED)
        self.assertEqual(int.from_bytes(rig.records(START)[0][36:40], "little"), 7)
        rig.close_inputs(AT_REST | ARM)
        until(lambda: rig.log()[-1][11] == 3, "ARM in the log")
        self.assertEqual(rig.state(), DISARMED)
        rig.close_inputs(AT_REST | CONFIRM)
        until(lambda: rig.log()[-1][11] == 8, "CONFIRM in the log")
        rig.close_inputs(AT_REST)
        rig.arm()

    def test_without_a_configuration_nothing_leaves(self):
        rig = Rig(self, bytes(reversed(compiled())))
        until(rig.log, "the start")
        rig.host.sendall(b"c\x03" + SLOW)
        until(lambda: len(rig.log()) > 2, "what was dropped")
        self.assertEqual((rig.state(), rig.controller_got()), (LOCKED, b""))

    def test_limits_that_change_in_memory_are_a_reset_that_stops_what_moves(self):
        rig = Rig(self, compiled())
        rig.arm()
        rig.start_slow_move()
        rig.flip((100 * 64).to_bytes(4, "little") * 3)
        until(lambda: len(rig.records(START)) == 2, "the reset")
        self.assertEqual(rig.records(START)[1][11], 1)
        rig.close_inputs(AT_REST)  # what UART 3 was told is forgotten
        rig.wait_for_state(DISARMED)
        self.assertRegex(rig.controller_got(), rb"^\x03[\x03c]*c$")
        x = int.from_bytes(rig.ask(b"c", 14)[:4], "little")
        self.assertTrue(20000 < x < 250000, x)

    def test_dryrig_through_it(self):
        rig = Rig(self, compiled(), host_pty=True)
        rig.arm()

        def dryrig(*words):
            return subprocess.run([DRYRIG, "--port", rig.port, "--controller", "trio", "--stage", "MP-845", *words],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=PATIENCE_S)

        self.assertIn("1875", dryrig("position").stdout.replace(",", ""))
        done = dryrig("line", "1899", "1875", "1875", "--speed", "15")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("1899", dryrig("position").stdout.replace(",", ""))
        self.assertNotEqual(dryrig("line", "1899", "1875", "10", "--speed", "15").returncode, 0)


if __name__ == "__main__":
    unittest.main()
