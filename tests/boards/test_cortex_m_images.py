"""The Cortex-M images in QEMU, through a socket, as a program on a computer would talk to the board. QEMU's clock follows
the computer's, so nothing here is about time.

    test_cortex_m_images.py QEMU IMAGES
"""
import socket
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

from images import point

QEMU, IMAGES = (sys.argv.pop(1) for _ in range(2))
PATIENCE_S = 60


class Board:
    """An image that runs, and its line."""

    def __init__(self, controller):
        self.temporary = tempfile.TemporaryDirectory()
        path = str(Path(self.temporary.name, "line"))
        self.process = subprocess.Popen(
            [QEMU, *"-M mps2-an385 -display none -monitor none -serial chardev:line".split(),
             "-chardev", f"socket,id=line,path={path},server=on,wait=off",
             "-kernel", str(Path(IMAGES, f"cortex-m-{controller}.elf"))])
        self.line = socket.socket(socket.AF_UNIX)
        self.line.settimeout(PATIENCE_S)
        end = time.monotonic() + PATIENCE_S
        while True:
            try:
                return self.line.connect(path)
            except (FileNotFoundError, ConnectionRefusedError):
                if time.monotonic() > end or self.process.poll() is not None:
                    self.close()
                    raise
                time.sleep(0.01)

    def ask(self, said, count):
        self.line.sendall(said)
        got = b""
        while len(got) < count:
            more = self.line.recv(count - len(got))
            if not more:
                break
            got += more
        return got

    def close(self):
        self.line.close()
        self.process.kill()
        self.process.wait()
        self.temporary.cleanup()


class Images(unittest.TestCase):
    def board(self, controller):
        board = Board(controller)
        self.addCleanup(board.close)
        return board

    def test_trio(self):
        board = self.board("trio")
        self.assertEqual(board.ask(b"c", 14), point(10667, 10667, 10667) + b"\x1e\r")  # after its calibration
        for v in range(0, 256, 5):
            there = point(0x2900 + v, 0x2A00 - v, 0x2900 + (v ^ 0x55))
            self.assertEqual(board.ask(b"S\x0f" + there, 1), b"\r")
            self.assertEqual(board.ask(b"c", 14), there + b"\x1e\r")
        self.assertEqual(board.ask(b"H" + point(0, 0, 0), 1), b"\r")
        self.assertEqual(board.ask(b"\xee\x22\r\nc", 14), point(0, 0, 0) + b"\x1e\r")
        board.line.sendall(b"S\x00" + point(266667, 0, 0))
        self.assertEqual(board.ask(b"\x03", 1), b"\r")

    def test_mpc_and_its_stream(self):
        board = self.board("mpc")
        self.assertEqual(board.ask(b"U", 6), b"\x02\x01\x01\x00\x00\r")
        self.assertEqual(board.ask(b"K", 4), b"\x01\x21\x03\r")
        self.assertEqual(board.ask(b"O", 1), b"\r")
        at, first = [], board.ask(b"S\x05" + point(1600, 0, 0), 1)  # 487.5 um/s: every micron fits the line
        while first == b"\xff":
            frame = first + board.ask(b"", 11)
            self.assertEqual((frame[:3], frame[6:]), (b"\xff\xff\xff", bytes(6)))
            at.append(int.from_bytes(frame[3:6], "little"))
            first = board.ask(b"", 1)
        self.assertEqual(first, b"\r")
        # A loaded computer makes QEMU late, and a late board tells the newest position only.
        self.assertEqual(at, sorted(set(at)))
        self.assertTrue(set(at) <= set(range(16, 1601, 16)))
        self.assertEqual(board.ask(b"C", 14), b"\x01" + point(1600, 0, 0) + b"\r")


if __name__ == "__main__":
    unittest.main()
