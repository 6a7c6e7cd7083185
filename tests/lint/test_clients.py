"""Host programs as people write them, all but one of them right, in their own ways with a port: the lint has nothing to say, with either
controller, at any clock.

    test_clients.py                              the tests
    test_clients.py --be STYLE trio|mpc          one of the programs, under `run`"""
import os
import queue
import re
import select
import struct
import subprocess
import sys
import threading
import time
import unittest

import realtime
import serial

PAUSE_S = 0.0025
LONGEST_S = 60
# The kernel carries bytes between the two sides of a pseudo-terminal by a worker of its own. Where that waits for a processor, a
# pause looks shorter than it was, and nobody can know (docs/ci.md).
PAUSES = {"hurried-command", "no-pause-in-s"}
ATTEMPTS = 5


class Blocking:
    """pyserial, reads of the whole answer."""

    def __init__(self):
        self.port = self.open()
        time.sleep(PAUSE_S)

    def open(self):
        return serial.Serial(os.environ["DRYRIG_PORT"], 57600 if KIND == "trio" else 128000, timeout=LONGEST_S)

    def write(self, data):
        self.port.write(data)

    def read(self, count):
        return self.port.read(count)

    def ask(self, data, count, pause_s=0.0):
        if pause_s:
            self.write(data[:2])
            time.sleep(pause_s)
            data = data[2:]
        self.write(data)
        answer = self.read(count)
        assert len(answer) == count and answer[-1:] == b"\r", answer
        time.sleep(PAUSE_S)
        return answer

    def close(self):
        self.port.close()


class Cautious(Blocking):
    """Clears both buffers before each command and drains what it writes, byte by byte."""

    def write(self, data):
        self.port.reset_input_buffer()
        self.port.reset_output_buffer()
        for byte in data:
            self.port.write(bytes([byte]))
            self.port.flush()


class InWaiting(Blocking):
    """Looks every millisecond whether all is there."""

    def read(self, count):
        while self.port.in_waiting < count:
            time.sleep(0.001)
        return self.port.read(count)


class Spinning(Blocking):
    """Reads without waiting, again and again."""

    def open(self):
        return serial.Serial(os.environ["DRYRIG_PORT"], 57600 if KIND == "trio" else 128000, timeout=0, exclusive=True)

    def read(self, count):
        got = b""
        while len(got) < count:
            got += self.port.read(count - len(got))
        return got


class Impatient(Blocking):
    """Short time limits, but it reads on until all is there."""

    def open(self):
        return serial.Serial(os.environ["DRYRIG_PORT"], 57600 if KIND == "trio" else 128000, timeout=0.01, inter_byte_timeout=0.005)

    def read(self, count):
        got = b""
        while len(got) < count:
            got += self.port.read(count - len(got))
        return got


class Listener(Blocking):
    """A thread that reads all the time and hands over byte by byte."""

    def open(self):
        port = super().open()
        port.timeout = 0.05
        self.bytes = queue.Queue()
        self.is_over = False
        self.thread = threading.Thread(target=self.listen, args=(port,))
        self.thread.start()
        return port

    def listen(self, port):
        while not self.is_over:
            for byte in port.read(64 if port.in_waiting > 1 else 1):
                self.bytes.put(byte)

    def read(self, count):
        return bytes(self.bytes.get(timeout=LONGEST_S) for _ in range(count))

    def close(self):
        self.is_over = True
        self.thread.join()
        self.port.close()


class Reopening(Blocking):
    """Opens the port for each command, as scripts for one command do."""

    def ask(self, data, count, pause_s=0.0):
        answer = super().ask(data, count, pause_s)
        self.port.close()
        self.port = self.open()
        time.sleep(PAUSE_S)
        return answer


class Bare(Blocking):
    """No library: a file descriptor and select(), as it comes from open()."""

    def open(self):
        return os.open(os.environ["DRYRIG_PORT"], os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def write(self, data):
        assert os.write(self.port, data) == len(data)

    def read(self, count):
        got = b""
        while len(got) < count and select.select([self.port], [], [], LONGEST_S)[0]:
            got += os.read(self.port, count - len(got))
        return got

    def close(self):
        os.close(self.port)


STYLES = {style.__name__: style for style in (Blocking, Cautious, InWaiting, Spinning, Impatient, Listener, Reopening, Bare)}


def talk(host):
    """Everything that answers something of its own, with 0D, FF and 03 among the bytes."""
    there, back = struct.pack("<III", 0x0D0D, 0x03FF, 0x0D03), struct.pack("<III", 0x0F0D, 0x04FF, 0x0DFF)
    if KIND == "trio":
        host.ask(b"A\x2d", 1)
        for letter in (b"x", b"y", b"z"):
            host.ask(letter + back[:4], 1)
        host.ask(b"W" + there, 1)
        assert host.ask(b"c", 14)[:12] == there
        host.ask(b"S\x0d" + back, 1)
        assert host.ask(b"c", 14)[:12] == back
        host.ask(b"h", 1)
        host.ask(b"R", 1)
        host.ask(b"\x03", 1)
    else:
        assert host.ask(b"K", 4) == b"\x01\x21\x03\r"
        host.ask(b"U", 6)
        host.ask(b"L\x03", 1)
        host.ask(b"M" + there, 1)
        assert host.ask(b"C", 14)[1:13] == there
        if not isinstance(host, Reopening):  # F is good for one opening
            host.ask(b"F", 1)
            host.ask(b"S\x0d" + back, 1, pause_s=0.03)
            assert host.ask(b"C", 14)[1:13] == back
        host.ask(b"H", 1)
        host.ask(b"N", 1)
        host.ask(b"\x03", 1)


class Clients(realtime.TestCase):
    maxDiff = None

    def keeps_the_rules(self, *command):
        for kind in ("trio", "mpc"):
            for clock in ("real", "jump"):
                with self.subTest(f"{kind} {clock}"):
                    for _ in range(ATTEMPTS):
                        done = subprocess.run([os.environ["DRYRIG_EMU"], "run", kind, "--clock", clock, "--strict", "--",
                                               *(word.replace("KIND", kind) for word in command)],
                                              capture_output=True, text=True, check=False, timeout=2 * LONGEST_S)
                        found = re.findall(r"^\d+ ([a-z0-9-]+), \d+ time", done.stderr, re.MULTILINE)
                        if not found or not PAUSES.issuperset(found):
                            break
                    self.assertEqual((0, ""), (done.returncode, done.stderr))

    def test_c_blocking(self):
        self.keeps_the_rules(os.environ["CLIENT"], "KIND", "blocking")

    def test_c_that_leaves_a_byte(self):
        """However quick it reads it with the next answer."""
        for kind in ("trio", "mpc"):
            for clock in ("real", "jump"):
                with self.subTest(f"{kind} {clock}"):
                    done = subprocess.run([os.environ["DRYRIG_EMU"], "run", kind, "--clock", clock, "--strict", "--",
                                           os.environ["CLIENT"], kind, "leaving"],
                                          capture_output=True, text=True, check=False, timeout=LONGEST_S)
                    self.assertEqual(3, done.returncode)
                    self.assertRegex(done.stderr, "unread-reply, 1 time|thirteen-bytes, 1 time")

    def test_c_polling(self):
        self.keeps_the_rules(os.environ["CLIENT"], "KIND", "polling")


for name in STYLES:
    setattr(Clients, f"test_{name.lower()}",
            lambda self, style=name: self.keeps_the_rules(sys.executable, __file__, "--be", style, "KIND"))

if __name__ == "__main__":
    if "--be" in sys.argv:
        KIND = sys.argv[3]
        the_host = STYLES[sys.argv[2]]()
        talk(the_host)
        the_host.close()
    else:
        unittest.main()
