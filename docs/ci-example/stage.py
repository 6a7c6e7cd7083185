"""A small host program for an MPC-200, as one might write it with the manual at hand: it works with a fake port, and has three
bugs that a real controller punishes. docs/ci.md finds them; stage_fixed.py is without them."""
import os
import struct
import sys
import time

import serial

STEPS_PER_UM = 16  # MP-225


class Stage:
    def __init__(self, port):
        self.port = port

    def command(self, data):
        self.port.write(data)
        if self.port.read(1) != b"\r":
            raise OSError("no answer")
        time.sleep(0.002)

    def position_um(self):
        self.port.write(b"C")
        answer = self.port.read(13)  # bug 2: the CR makes it 14
        time.sleep(0.002)
        return tuple(steps / STEPS_PER_UM for steps in struct.unpack("<xIII", answer))

    def line_um(self, x, y, z, speed):
        target = (int(um * STEPS_PER_UM) for um in (x, y, z))
        self.port.write(b"S" + bytes([speed]) + struct.pack("<III", *target))  # bug 1: 30 ms belong behind the speed
        time.sleep(0.1)  # bug 3: it moves for as long as it takes, and its CR says when it is there


def approach(stage):
    stage.command(b"F")
    before = stage.position_um()
    stage.line_um(1000, 1000, 500, speed=15)
    return before, stage.position_um()


def main():
    with serial.Serial(os.environ["DRYRIG_PORT"], 128000, timeout=2) as port:
        print(approach(Stage(port)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
