"""dryrig, the command line on the host library, against simulated boards, in the computer's time: each image as a program on
the rig's computer meets it.

    test_dryrig.py DRYRIG AVR_BOARD QEMU BUILDS
"""
import json
import re
import signal
import subprocess
import sys
import time
import unittest

import realtime

DRYRIG, AVR_BOARD, QEMU, BUILDS = (sys.argv.pop(1) for _ in range(4))
LIMIT_S = 90  # that only a broken program reaches


def avr(board, mcu, *options):
    return lambda kind: ([AVR_BOARD, *options, mcu, f"{BUILDS}/avr-{board}/{board}-{kind}.elf"], r"ready (\S+)")


BOARDS = {
    "uno": avr("uno", "atmega328p"),
    "mega": avr("mega", "atmega2560"),
    "leonardo": avr("leonardo", "atmega32u4", "--usb"),
    "cortex-m": lambda kind: ([QEMU, *"-M mps2-an385 -display none -monitor none -serial pty -kernel".split(),
                               f"{BUILDS}/cortex-m/cortex-m-{kind}.elf"], r"char device redirected to (\S+)"),
}


class Rig:
    """A board that runs, and dryrig's options for it."""

    def __init__(self, board, kind):
        command, ready = BOARDS[board](kind)
        self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                        text=True)
        path = re.match(ready, self.process.stdout.readline()).group(1)
        stage = {"trio": "MP-845", "mpc": "MP-225"}[kind]
        self.options = ["--port", path, "--controller", kind, "--stage", stage]
        end = time.monotonic() + LIMIT_S
        while subprocess.run([DRYRIG, *self.options, "position"], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                             stderr=subprocess.DEVNULL, timeout=LIMIT_S).returncode != 0:  # it starts, and a TRIO calibrates
            if time.monotonic() > end:
                raise AssertionError("the board does not answer")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.communicate(timeout=LIMIT_S)

    def run(self, *words, expect=0):
        done = subprocess.run([DRYRIG, *self.options, *words], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, timeout=LIMIT_S)
        if done.returncode != expect:
            raise AssertionError(f"{words}: exit status {done.returncode}, not {expect}: {done.stdout} {done.stderr}")
        return done.stdout

    def json(self, *words):
        return [json.loads(line) for line in self.run("--json", *words).splitlines() if line[:1] == "{"]


class Boards(realtime.TestCase):
    def trio(self, board):
        with Rig(board, "trio") as rig:
            self.assertEqual("trio", rig.json("info")[-1]["controller"])
            rig.run("move", "1500", "750", "1125")
            self.assertEqual([16000, 8000, 12000], rig.json("position")[-1]["position"]["steps"])
            rig.run("line", "1000", "900", "950", "--speed", "15")
            rig.run("axis", "x", "937.5")
            rig.run("angle", "45")
            self.assertIn("angle 45 degrees", rig.run("position"))
            rig.run("home")
            self.assertEqual([0, 0, 0], rig.json("position")[-1]["position"]["steps"])
            rig.run("calibrate")
            rig.run("stop")

    def mpc(self, board):
        with Rig(board, "mpc") as rig:
            info = rig.json("info")[-1]
            self.assertEqual(("mpc", "3.21", [1, 2]), tuple(info[key] for key in ("controller", "firmware", "connected")))
            rig.run("move", "100", "200", "300")
            self.assertEqual([1600, 3200, 4800], rig.json("position")[-1]["position"]["steps"])
            rows = rig.json("line", "160", "200", "300", "--speed", "15", "--stream")
            self.assertTrue(rows[-1]["ok"])
            self.assertGreater(len(rows), 2)
            self.assertTrue(all(1600 < row["streamed"]["steps"][0] <= 2560 for row in rows[:-1]))
            rig.run("select", "2")
            rig.run("mode", "3")
            rig.run("select", "3", expect=1)
            rig.run("select", "1")
            rig.run("home")
            self.assertEqual([0, 0, 0], rig.json("position")[-1]["position"]["steps"])

    def test_uno(self):
        self.trio("uno")
        self.mpc("uno")

    def test_mega(self):
        self.mpc("mega")

    def test_leonardo(self):
        self.trio("leonardo")
        self.mpc("leonardo")

    def test_cortex_m(self):
        self.trio("cortex-m")
        self.mpc("cortex-m")

    def test_interrupted_on_an_uno(self):
        with Rig("uno", "mpc") as rig:
            process = subprocess.Popen([DRYRIG, *rig.options, "--json", "line", "5000", "0", "0", "--speed", "0", "--stream"],
                                       stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            process.stdout.readline()  # it moves
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=LIMIT_S)
            self.assertEqual(130, process.returncode)
            x = rig.json("position")[-1]["position"]["steps"][0]
            self.assertTrue(0 < x < 80000, x)


if __name__ == "__main__":
    unittest.main()
