"""What such programs are often tested with: a port that says what one wants to hear. stage.py passes."""
import struct
import unittest

from stage import Stage, approach


class FakePort:
    def __init__(self):
        self.steps = (0, 0, 0)
        self.answer = b""

    def write(self, data):
        if data[:1] == b"C":
            self.answer = b"\x01" + struct.pack("<III", *self.steps) + b"\r"
        else:
            if data[:1] == b"S":
                self.steps = struct.unpack("<III", data[2:])
            self.answer = b"\r"

    def read(self, count):
        answer, self.answer = self.answer[:count], b""
        return answer


class Approach(unittest.TestCase):
    def test_it_arrives(self):
        self.assertEqual(approach(Stage(FakePort())), ((0, 0, 0), (1000, 1000, 500)))


if __name__ == "__main__":
    unittest.main()
