"""The program against a controller of its own in each test, with the lint: what pytest does with a fixture (docs/ci.md)."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

import serial

import stage_fixed

EMULATOR = os.environ.get("DRYRIG_EMU", "dryrig-emu")


class Controller:
    """An MPC-200 from `with` to its end. Then `findings` is what the host did wrong."""

    def __enter__(self):
        self.where = tempfile.TemporaryDirectory()
        self.report = os.path.join(self.where.name, "lint.json")
        self.emulator = subprocess.Popen([EMULATOR, "mpc", "--clock", "jump", "--lint-json", self.report],
                                         stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self.port = self.emulator.stdout.readline().decode().split()[1]  # "ready /dev/pts/3"
        return self

    def __exit__(self, *_):
        self.emulator.terminate()
        self.emulator.communicate()
        with open(self.report, encoding="utf-8") as file:
            self.findings = json.load(file)["findings"]
        self.where.cleanup()


class Approach(unittest.TestCase):
    def test_it_arrives_and_breaks_no_rule(self):
        with Controller() as controller:
            with serial.Serial(controller.port, 128000, timeout=10) as port:
                before, after = stage_fixed.approach(stage_fixed.Stage(port))
        self.assertEqual(((0, 0, 0), (1000, 1000, 500)), (before, after))
        self.assertEqual([], controller.findings)


if __name__ == "__main__":
    sys.exit(unittest.main())
