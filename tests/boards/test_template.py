"""The template board is a program that runs: what it says on its line, and that its memory outlives it.

    test_template.py TRIO MPC    (the two programs)
"""
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

LIMIT_S = 60
TRIO, MPC = (Path(sys.argv.pop(1)) for _ in range(2))


def ask(board, said, until=lambda: True, **environment):
    """What the board answers; the line is kept open until something is so."""
    process = subprocess.Popen([board], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment)
    process.stdin.write(said)
    process.stdin.flush()
    end = time.monotonic() + LIMIT_S
    while not until() and time.monotonic() < end:
        time.sleep(0.01)
    return process.communicate(timeout=LIMIT_S)[0]


class Template(unittest.TestCase):
    def test_mpc_tells_its_drives_and_version(self):
        self.assertEqual(ask(MPC, b"UK"), b"\x02\x01\x01\x00\x00\r" b"\x01\x21\x03\r")

    def test_straps_make_a_trio_of_an_mpc(self):
        self.assertEqual(ask(MPC, b"A\x1e", STRAPS="9"), b"\r")

    def test_memory_outlives_the_process(self):
        with tempfile.TemporaryDirectory() as temporary:
            memory = Path(temporary, "memory")
            there = b"\x10\0\0\0\x20\0\0\0\x30\0\0\0"
            self.assertEqual(ask(TRIO, b"S\x0f" + there, lambda: memory.exists() and memory.stat().st_size > 0, STRAPS="8", MEMORY=memory), b"\r")
            self.assertEqual(ask(TRIO, b"c", STRAPS="8", MEMORY=memory), there + b"\x1e\r")


if __name__ == "__main__":
    unittest.main()
