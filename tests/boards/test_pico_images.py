"""The Pico's images in rp2040js, in the chip's own time; a part of what the AVR boards are asked, for it is slow.

    test_pico_images.py NODE RP2040JS ROM.bin IMAGES
"""
import socket
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import images
from images import between, point, spaced

NODE, RP2040JS, ROM, IMAGES = (sys.argv.pop(1) for _ in range(4))
RUNNER = str(Path(__file__).with_name("pico") / "pico_board.mjs")
READY_US = 30_000  # USB has connected


def command(controller, *options):
    return [NODE, RUNNER, RP2040JS, ROM, str(Path(IMAGES, f"pico-{controller}.bin")), *options]


def run(controller, events, *options):
    return images.run(command(controller, *options, "--script"), events)


class Pico(unittest.TestCase):
    def test_mpc_answers(self):
        dialogue = [
            (b"U", b"\x02\x01\x01\x00\x00\r"), (b"K", b"\x01\x21\x03\r"), (b"C", b"\x01" + point(0, 0, 0) + b"\r"),
            (b"I\x02", b"\x02\r"), (b"I\x03", b"E\r"), (b"I\x01", b"\x01\r"), (b"\xee\x22\r\n", b""), (b"\x03", b"\r"),
            (b"Y", b"\r"), (b"L\x03", b"\r"), (b"F", b"\r"),
        ]
        sent = run("mpc", spaced(READY_US, 5000, [ask for ask, _ in dialogue]) + [(READY_US + 5000 * len(dialogue), "stop")])
        for i, (ask, answer) in enumerate(dialogue):
            with self.subTest(ask=ask):
                self.assertEqual(between(sent, READY_US + 5000 * i, READY_US + 5000 * (i + 1)), answer)

    def test_every_byte_value_arrives_and_leaves_at_the_controllers_pace(self):
        targets = [point(v, 255 - v, v ^ 0x55) for v in range(0, 256, 3)] + [point(v, 255 - v, v ^ 0x55) for v in range(1, 256, 3)]
        events = spaced(READY_US, 6000, [frame for target in targets for frame in (b"M" + target, b"C")])
        end = events[-1][0] + 6000
        sent = run("mpc", events + [(end, "stop")])
        self.assertEqual(between(sent, READY_US, end), b"".join(b"\r\x01" + target + b"\r" for target in targets))
        reply = [us for us, _ in sent if us >= events[1][0]][:14]
        self.assertAlmostEqual(reply[-1] - reply[0], 13 * 78.125, delta=100)

    def test_buttons_and_knobs(self):
        # Knob X (GP12, 13) a detent; STOP (GP8) ends a host's move; MANIPULATOR (GP11).
        at = READY_US
        events = [(at, "low 12"), (at + 2000, "low 13"), (at + 4000, "open 12"), (at + 6000, "open 13"), (at + 10_000, b"C"),
                  (at + 14_000, b"M" + point(16000, 0, 0)), (at + 20_000, "low 8"), (at + 40_000, b"K"), (at + 45_000, "low 11"),
                  (at + 60_000, b"K"), (at + 65_000, "stop")]
        sent = run("mpc-hands", events)
        self.assertEqual(between(sent, at, at + 14_000), b"\x01" + point(64, 0, 0) + b"\r")
        self.assertEqual(between(sent, at + 14_000, at + 25_000), b"")
        self.assertEqual(between(sent, at + 25_000, at + 40_000), b"\r")  # 8 looks later; the way takes 330 ms
        self.assertEqual(between(sent, at + 40_000, at + 65_000), b"\x01\x21\x03\r\x02\x21\x03\r")

    def test_stream_and_interrupt(self):
        begin = READY_US + 80_000
        sent = run("mpc", [(READY_US, b"O"), (READY_US + 10_000, b"S"), (READY_US + 40_000, b"\x03"), (begin, point(3200, 0, 0)),
                           (begin + 41_500, b"\x03"), (begin + 60_000, "stop")])
        data = between(sent, begin, begin + 60_000)
        count = (len(data) - 1) // 12  # 325 um/s: 13.5 microns in 41.5 ms
        self.assertEqual((count, data[-1:], len(data)), (13, b"\r", 13 * 12 + 1))
        for k in range(count):
            x = (16 * (k + 1)).to_bytes(3, "little")
            self.assertEqual(data[12 * k:12 * k + 12], b"\xff\xff\xff" + x + bytes(6))

    def test_a_trio_by_strap_calibrates_and_keeps_its_position(self):
        with tempfile.TemporaryDirectory() as temporary:
            memory = str(Path(temporary, "memory"))
            there = point(10667, 10000, 10333)
            # straps: the other controller; switch 6 "None"
            sent = run("mpc", [(READY_US, b"S\x0f" + there), (READY_US + 1_200_000, "stop")], "--straps", "9", "--memory", memory)
            self.assertEqual(bytes(byte for _, byte in sent), b"\r")
            sent = run("trio", [(READY_US, b"c"), (READY_US + 10_000, "stop")], "--straps", "8", "--memory", memory)
            self.assertEqual(bytes(byte for _, byte in sent), there + b"\x1e\r")

    def test_a_socket_is_a_line(self):
        with tempfile.TemporaryDirectory() as temporary:
            path = str(Path(temporary, "line"))
            process = subprocess.Popen(command("mpc", "--socket", path), stdout=subprocess.PIPE, text=True)
            try:
                self.assertEqual(process.stdout.readline(), f"ready {path}\n")
                with socket.socket(socket.AF_UNIX) as line:
                    line.connect(path)
                    line.settimeout(60)
                    line.sendall(b"U")
                    got = b""
                    while len(got) < 6:
                        got += line.recv(6)
                    self.assertEqual(got, b"\x02\x01\x01\x00\x00\r")
            finally:
                process.terminate()
                process.communicate(timeout=60)

    def test_the_uf2_file_holds_the_image(self):
        image = Path(IMAGES, "pico-trio.bin").read_bytes()
        blocks = Path(IMAGES, "pico-trio.uf2").read_bytes()
        got = b""
        for at in range(0, len(blocks), 512):
            block = blocks[at:at + 512]
            first, second, flags, address, size, number, count, family = struct.unpack("<8I", block[:32])
            self.assertEqual((first, second, flags, size, number, count, family, block[-4:]),
                             (0x0A324655, 0x9E5D5157, 0x2000, 256, at // 512, len(blocks) // 512, 0xE48BFF56,
                              b"\x30\x6f\xb1\x0a"))
            self.assertEqual(address, 0x10000000 + len(got))
            got += block[32:288]
        self.assertEqual(got[:len(image)], image)


if __name__ == "__main__":
    unittest.main()
