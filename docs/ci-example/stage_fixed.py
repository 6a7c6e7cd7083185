"""stage.py without its bugs."""
import os
import struct
import sys
import time

import serial

STEPS_PER_UM = 16  # MP-225
LONGEST_MOVE_S = 400  # 25 mm at the slowest speed, and some


class Stage:
    def __init__(self, port):
        self.port = port

    def read(self, count):
        answer = self.port.read(count)
        if len(answer) != count or answer[-1:] != b"\r":
            raise OSError(f"expected {count} bytes with CR at the end, got {answer.hex(' ')}")
        time.sleep(0.002)  # before the next command
        return answer

    def command(self, data):
        self.port.reset_input_buffer()
        self.port.write(data)
        self.read(1)

    def position_um(self):
        self.port.reset_input_buffer()
        self.port.write(b"C")
        return tuple(steps / STEPS_PER_UM for steps in struct.unpack("<xIIIx", self.read(14)))

    def line_um(self, x, y, z, speed):
        target = (int(um * STEPS_PER_UM) for um in (x, y, z))
        self.port.reset_input_buffer()
        self.port.write(b"S" + bytes([speed]))
        self.port.flush()
        time.sleep(0.030)
        self.port.write(struct.pack("<III", *target))
        self.read(1)


def approach(stage):
    stage.command(b"F")
    before = stage.position_um()
    stage.line_um(1000, 1000, 500, speed=15)
    return before, stage.position_um()


def main():
    with serial.Serial(os.environ["DRYRIG_PORT"], 128000, timeout=LONGEST_MOVE_S) as port:
        time.sleep(0.002)
        before, after = approach(Stage(port))
        print(before, after)
    return 0 if after == (1000, 1000, 500) else 1


if __name__ == "__main__":
    sys.exit(main())
