"""What the tests of the program dryrig-emu share: starting it, and talking to it through its port as a plain program does.

No pyserial, no tty module: os.open() and os.read() must do. Waiting is always for something, with a limit that only a broken
program reaches; nothing here measures how fast anything is."""
import atexit
import contextlib
import fcntl
import os
import select
import signal
import struct
import subprocess
import tempfile
import termios
import time
import unittest

PROGRAM = os.environ["DRYRIG_EMU"]
LIMIT_S = 60.0


def start(*args, **popen):
    options = dict(stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL)
    options.update(popen)
    return ended_with_us(subprocess.Popen([PROGRAM, *args], **options))


def ended_with_us(process):
    """No process is left behind, however a test ends."""
    def end():
        process.kill()
        process.wait()
    atexit.register(end)
    return process


def outcome(*args):
    """Runs a start that should fail: (exit status, stdout, stderr)."""
    done = subprocess.run([PROGRAM, *args], stdin=subprocess.DEVNULL, capture_output=True, timeout=LIMIT_S)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


class Emulator:
    """A running emulator. As a context it is stopped at the end, and then its exit status is 0."""

    def __init__(self, *args, **popen):
        self.process = start(*args, **popen)
        line = self.process.stdout.readline().decode()
        if not line.startswith("ready /dev/pts/"):
            self.process.kill()
            raise AssertionError(f"no ready line but {line!r}; stderr: {self.process.stderr.read().decode()}")
        self.path = line.split()[1]

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        status = self.stop()
        if kind is None and status != 0:
            raise AssertionError(f"exit status {status}")

    def stop(self, how=signal.SIGTERM):
        if self.process.poll() is None:
            self.process.send_signal(how)
        self.out, self.err = (stream.decode() if stream else "" for stream in self.process.communicate(timeout=LIMIT_S))
        return self.process.returncode

    def wait_for(self, words):
        """Until a line of stderr (of --trace -) says so. Returns the line."""
        for line in self.process.stderr:
            if words in line:
                return line.decode()
        raise AssertionError(f"stderr ended without {words!r}")

    def cpu_ticks(self):
        """Processor time so far, in hundredths of a second."""
        with open(f"/proc/{self.process.pid}/stat", encoding="ascii") as file:
            fields = file.read().rpartition(")")[2].split()
        return int(fields[11]) + int(fields[12])

    def is_idle(self):
        """Does it come to sleep? A busy loop uses 25 ticks in each turn. (Other tests' terminals may wake it for a moment.)"""
        for _ in range(240):
            before = self.cpu_ticks()
            time.sleep(0.25)
            if self.cpu_ticks() - before <= 2:
                return True
        return False


class Port:
    """The host's end, as a plain program opens it."""

    def __init__(self, path, flags=0):
        self.fd = os.open(path, os.O_RDWR | os.O_NOCTTY | flags)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        if self.fd >= 0:
            os.close(self.fd)
        self.fd = -1

    def send(self, data):
        while data:
            data = data[os.write(self.fd, data):]

    def receive(self, count, limit_s=LIMIT_S):
        """Exactly so many bytes, or what came until the limit."""
        got = b""
        end = time.monotonic() + limit_s
        while len(got) < count:
            if not select.select([self.fd], [], [], max(0.0, end - time.monotonic()))[0]:
                break
            more = os.read(self.fd, count - len(got))
            if not more:
                break
            got += more
        return got

    def receive_through(self, ending):
        """Up to these bytes, behind which nothing comes, or what came until the limit."""
        got = b""
        end = time.monotonic() + LIMIT_S
        while not got.endswith(ending) and select.select([self.fd], [], [], max(0.0, end - time.monotonic()))[0]:
            got += os.read(self.fd, 65536)
        return got

    def ask(self, data, count):
        self.send(data)
        return self.receive(count)

    def waiting(self):
        """How many bytes can be read now."""
        return struct.unpack("i", fcntl.ioctl(self.fd, termios.FIONREAD, b"\0\0\0\0"))[0]

    def nothing_more(self, answered_by):
        """Is there nothing to read before the answer (`answered_by`: what to ask, and the answer)?"""
        question, answer = answered_by
        return self.ask(question, len(answer)) == answer and self.waiting() == 0


@contextlib.contextmanager
def directory():
    with tempfile.TemporaryDirectory(prefix="dryrig-") as path:
        yield path


class InDirectory(unittest.TestCase):
    """A test that has a directory of its own."""

    def setUp(self):
        context = directory()
        self.directory = context.__enter__()
        self.addCleanup(context.__exit__, None, None, None)


def wait_until(condition, what):
    end = time.monotonic() + LIMIT_S
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"waited in vain: {what}")
        time.sleep(0.002)


def point(x, y, z):
    return struct.pack("<III", x, y, z)


ACTIVE = (b"K", b"\x01\x21\x03\r")  # an MPC-200's answer that never changes
main = unittest.main
