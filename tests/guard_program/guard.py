"""What the tests of the program dryrig-guard share: a guard in front of an emulator, and its second channel."""
import concurrent.futures
import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
import unittest

import emu

PROGRAM = os.environ["DRYRIG_GUARD"]

MPC = """
format = 1; revision = 1; profile = "mpc-200"; firmware = "3.21";
knobs_locked = true; margin_um = %(margin)s; unstoppable_ms = 60000; %(more)s
drives = ( { number = 1; device = "MP-225"; microstep_um = 0.0625; switch8_on = true; max_move_um = 40000; %(drive)s
    box_um = { x = (%(low)s, %(high)s); y = (%(low)s, %(high)s); z = (%(low)s, %(high)s); }; } );
%(keepouts)s
"""
TRIO = """
format = 1; revision = 1; profile = "trio-mp245a"; firmware = "3.12";
external_switch5_on = true; external_switch6_on = false;
knobs_locked = true; margin_um = %(margin)s; unstoppable_ms = 60000; %(more)s
drives = ( { number = 1; device = "MP-845"; microstep_um = 0.09375; max_move_um = 40000; %(drive)s
    box_um = { x = (%(low)s, %(high)s); y = (%(low)s, %(high)s); z = (%(low)s, %(high)s); }; } );
%(keepouts)s
"""
POST = """keepouts = ( { name = "post"; drive = 1; exit = "-x";
    box_um = { x = (2000, 3000); y = (2000, 3000); z = (0, 25000); }; } );"""


def rig(text, **changes):
    values = dict(margin=0, low=0, high=25000, more="", drive="", keepouts="")
    values.update(changes)
    return text % values


def run(*args):
    """Runs the program to its end: (exit status, stdout, stderr)."""
    with emu.directory() as locks:
        done = subprocess.run([PROGRAM, *args], stdin=subprocess.DEVNULL, capture_output=True, timeout=emu.LIMIT_S,
                              env={**os.environ, "DRYRIG_LOCK_DIR": locks})
        if os.listdir(locks):
            raise AssertionError(f"left behind: {os.listdir(locks)}")
    return done.returncode, done.stdout.decode(), done.stderr.decode()


class Channel:
    """A connection to the second channel."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(emu.LIMIT_S)
        self.socket.connect(path)
        self.file = self.socket.makefile("rb")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.file.close()
        self.socket.close()

    def order(self, line):
        self.socket.sendall(line.encode() + b"\n")
        return self.answer()

    def answer(self):
        line = self.file.readline()
        if not line:
            raise AssertionError("the guard closed the channel")
        return json.loads(line)


class Guard:
    """A running guard in `directory`. As a context it is stopped at the end, and then its exit status is 0."""

    def __init__(self, directory, port, config, *args, wait="disarmed", **popen):
        self.link, self.socket, self.log, self.config = (
            os.path.join(directory, name) for name in ("host", "control", "log", "rig.conf"))
        with open(self.config, "w", encoding="ascii") as file:
            file.write(config)
        self.args = ["--port", port, "--config", self.config, "--link", self.link, "--control", self.socket, "--log", self.log,
                     *args]
        self.err_path = os.path.join(directory, "stderr")
        self.popen = popen
        self.lock_directory = directory
        self.start(wait)

    def start(self, wait="disarmed"):
        with open(self.err_path, "ab") as err:
            options = dict(stdout=subprocess.PIPE, stderr=err, stdin=subprocess.DEVNULL)
            options.update(self.popen)
            options["env"] = {**(options.get("env") or os.environ), "DRYRIG_LOCK_DIR": self.lock_directory}
            self.process = emu.ended_with_us(subprocess.Popen([PROGRAM, *self.args], **options))
        line = self.process.stdout.readline().decode()
        if not line.startswith("ready /dev/pts/"):
            self.process.kill()
            self.process.wait()
            raise AssertionError(f"no ready line but {line!r}; stderr: {self.err()}")
        self.path = line.split()[1]
        if wait:
            self.wait_for(wait)

    def err(self):
        with open(self.err_path, encoding="utf-8") as file:
            return file.read()

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        status = self.stop()
        if kind is None and status != 0:
            raise AssertionError(f"exit status {status}; stderr: {self.err()}")

    def stop(self, how=signal.SIGTERM):
        if self.process.poll() is None:
            self.process.send_signal(how)
        self.process.wait(timeout=emu.LIMIT_S)
        self.process.stdout.close()
        return self.process.returncode

    def kill(self):
        self.stop(signal.SIGKILL)

    def order(self, line):
        with Channel(self.socket) as channel:
            return channel.order(line)

    def status(self):
        return self.order("status")

    def wait_for(self, state):
        try:
            emu.wait_until(lambda: self.status()["state"] == state, f"state {state}")
        except AssertionError as problem:
            raise AssertionError(f"{problem}; it is {self.status()}") from None

    def arm(self):
        answer = self.order("arm")
        if not answer["ok"]:
            raise AssertionError(answer)

    def switches(self):
        with open(f"/proc/{self.process.pid}/status", encoding="ascii") as file:
            return int(next(line for line in file if line.startswith("voluntary_ctxt_switches")).split()[1])


@contextlib.contextmanager
def guarded(kind, config, *args, guard_args=(), **options):
    """An emulator, a guard before it that is armed, and a host that has the guard's port open."""
    with emu.directory() as directory, emu.Emulator(kind, *args, "--link", os.path.join(directory, "emu")) as emulator:
        with Guard(directory, emulator.path, config, *guard_args, **options) as guard, emu.Port(guard.path) as port:
            guard.arm()
            yield emulator, guard, port


def move_mpc(x, y, z):
    """S of an MPC-200 is sent by line(); this is M: whole microns of an MP-225."""
    return b"M" + emu.point(x * 16, y * 16, z * 16)


def line(speed, x, y, z, steps_per_um=16):
    return b"S" + bytes([speed]) + emu.point(*(int(um * steps_per_um) for um in (x, y, z)))


def position_mpc(reply):
    assert len(reply) == 14 and reply[-1:] == b"\r", reply
    return tuple(int.from_bytes(reply[1 + 4 * i:5 + 4 * i], "little") / 16 for i in range(3))


def pause(seconds):
    """For what takes its time in the real world, as a move does: never a measure of anything."""
    time.sleep(seconds)


def each_test(suite):
    for part in suite:
        if isinstance(part, unittest.TestSuite):
            yield from each_test(part)
        else:
            yield part


def main(threads=4):
    """unittest.main(), with several tests at once: each waits most of its time, for the second after which a controller is asked
    who it is. With arguments it is unittest.main() itself."""
    if len(sys.argv) > 1:
        unittest.main(module="__main__")
    tests = list(each_test(unittest.defaultTestLoader.loadTestsFromModule(sys.modules["__main__"])))
    with concurrent.futures.ThreadPoolExecutor(threads) as pool:
        results = list(pool.map(lambda test: test.run(), tests))
    for result in results:
        for test, words in result.failures + result.errors:
            print(f"{test}\n{words}", file=sys.stderr)
    bad = sum(not result.wasSuccessful() for result in results)
    print(f"{len(tests)} tests, {bad} of them failed")
    sys.exit(1 if bad or not tests else 0)
