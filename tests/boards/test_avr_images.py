"""The images of AVR boards, as they are flashed, in a simulator of the chip (avr_board), in the chip's own time.

    test_avr_images.py AVR_BOARD IMAGES uno|mega|leonardo [-hands]    (IMAGES: the directory of the board's build; -hands: the
                                                                       images with buttons, of which none is pressed)

Expected answers are typed from PROTOCOL.md and the manuals [T] and [M]. Times are microseconds of the board's clock from its
start. 57600 baud at 16 MHz are 57143, 128000 are 125000.
"""
import sys
import tempfile
import unittest
from pathlib import Path

import images
from images import between, point, spaced

RUNNER, IMAGES, BOARD = (sys.argv.pop(1) for _ in range(3))
HANDS = sys.argv.pop(1) if sys.argv[1:2] == ["-hands"] else ""
MCU = {"uno": "atmega328p", "mega": "atmega2560", "leonardo": "atmega32u4"}[BOARD]
IS_USB = BOARD == "leonardo"
# Arduino's pins 2 to 5 as ports of the chip (the boards' circuit diagrams).
STRAPS = {"uno": ["D2", "D3", "D4", "D5"], "mega": ["E4", "E5", "G5", "E3"], "leonardo": ["D1", "D0", "D4", "C6"]}[BOARD]
READY_US = 2_500_000  # a Leonardo is enumerated by then, and a TRIO has calibrated


def run(controller, events, memory=None, straps=()):
    low = "".join(sorted(STRAPS[number] for number in straps))
    options = [*(["--usb"] if IS_USB else []), *(["--memory", memory] if memory else []), "--low", low, "--script", "-"]
    return images.run([RUNNER, *options, MCU, str(Path(IMAGES, f"{BOARD}-{controller}{HANDS}.elf"))], events)


class Commands(unittest.TestCase):
    def test_every_trio_command_answers_with_its_bytes_and_none_after(self):
        at_1000_um = point(10667, 10667, 10667)
        dialogue = [
            (b"c", at_1000_um + b"\x1e\r"), (b"C", at_1000_um + b"\x1e\r"), (b"\x03", b"\r"), (b"w", b"\r"),
            (b"H" + point(10600, 10601, 10602), b"\r"), (b"c", point(10600, 10601, 10602) + b"\x1e\r"),
            (b"W" + point(10700, 10701, 10702), b"\r"), (b"c", point(10700, 10701, 10702) + b"\x1e\r"),
            (b"x" + bytes([0x0D, 0x29, 0, 0]), b"\r"), (b"y" + bytes([0x03, 0x29, 0, 0]), b"\r"),
            (b"z" + bytes([0x0A, 0x29, 0, 0]), b"\r"), (b"c", point(0x290D, 0x2903, 0x290A) + b"\x1e\r"),
            (b"S\x0f" + point(10500, 10500, 10500), b"\r"), (b"A\x5a", b"\r"), (b"c", point(10500, 10500, 10500) + b"\x5a\r"),
            (b"A\x5b", b"\r"), (b"c", point(10500, 10500, 10500) + b"\x5a\r"), (b"\xee\x22\x5b\x5c\r\n", b""),
            (b"A\x1e", b"\r"), (b"c", point(10500, 10500, 10500) + b"\x1e\r"),
        ]
        sent = run("trio", spaced(READY_US, 60_000, [ask for ask, _ in dialogue]) +
                   [(READY_US + 60_000 * len(dialogue), "stop")])
        for i, (ask, answer) in enumerate(dialogue):
            with self.subTest(ask=ask):
                began = READY_US + 60_000 * i
                self.assertEqual(between(sent, began, began + 60_000), answer)

    def test_trio_home_and_recalibrate(self):
        sent = run("trio", [(READY_US, b"h"), (READY_US + 700_000, b"c"), (READY_US + 720_000, b"R"),
                            (READY_US + 1_500_000, b"c"), (READY_US + 1_600_000, "stop")])
        # Home: three axes one after the other, 1 mm at 5 mm/s; then out on all axes.
        self.assertEqual(between(sent, READY_US, READY_US + 590_000), b"")
        self.assertEqual(between(sent, READY_US + 590_000, READY_US + 630_000), b"\r")
        self.assertEqual(between(sent, READY_US + 700_000, READY_US + 720_000), point(0, 0, 0) + b"\x1e\r")
        self.assertEqual(between(sent, READY_US + 720_000, READY_US + 1_600_000), b"\r" + point(10667, 10667, 10667) + b"\x1e\r")

    def test_every_mpc_command_answers_with_its_bytes_and_none_after(self):
        dialogue = [
            (b"U", b"\x02\x01\x01\x00\x00\r"), (b"K", b"\x01\x21\x03\r"), (b"C", b"\x01" + point(0, 0, 0) + b"\r"),
            (b"M" + point(0x0D, 0x03, 0x0A), b"\r"), (b"C", b"\x01" + point(0x0D, 3, 0x0A) + b"\r"),
            (b"I\x02", b"\x02\r"), (b"C", b"\x02" + point(0, 0, 0) + b"\r"), (b"I\x03", b"E\r"), (b"I\x00", b"E\r"),
            (b"K", b"\x02\x21\x03\r"), (b"I\x01", b"\x01\r"), (b"H", b"\r"), (b"C", b"\x01" + point(0, 0, 0) + b"\r"),
            (b"Y", b"\r"), (b"L\x03", b"\r"), (b"L\x0a", b"\r"), (b"F", b"\r"), (b"O", b"\r"), (b"F", b"\r"), (b"\x03", b"\r"),
            (b"S\x0f", b""), (point(160, 160, 160), b"\r"), (b"C", b"\x01" + point(160, 160, 160) + b"\r"),
            (b"A\xee\x22\r\n", b""), (b"N", None), (b"", None), (b"", None), (b"", None), (b"", None), (b"", None),
            (b"C", b"\x01" + point(0, 0, 0) + b"\r"),
        ]
        sent = run("mpc", spaced(READY_US, 60_000, [ask for ask, _ in dialogue]) +
                   [(READY_US + 60_000 * len(dialogue), "stop")])
        for i, (ask, answer) in enumerate(dialogue):
            with self.subTest(ask=ask):
                began = READY_US + 60_000 * i
                if answer is not None:
                    self.assertEqual(between(sent, began, began + 60_000), answer)
        self.assertEqual(between(sent, READY_US + 24 * 60_000, READY_US + 30 * 60_000), b"\r")  # 'N' takes its time


class Line(unittest.TestCase):
    def test_every_byte_value_arrives_and_leaves(self):
        # X carries every value in its low byte, Y in the middle byte; a neighbour is 16 um away at 5,000 um/s.
        targets = [point(0x1000 + v, 0x001000 + 0x100 * (v ^ 0x80) // 16, 0x1000 + (255 - v)) for v in range(256)]
        frames = [frame for target in targets for frame in (b"S\x0f" + target, b"c")]
        # the first has the longest way: give it time
        events = [(READY_US, frames[0])] + spaced(READY_US + 1_000_000, 15_000, frames[1:])
        end = events[-1][0] + 15_000
        sent = between(run("trio", events + [(end, "stop")]), READY_US, end)
        self.assertEqual(sent, b"".join(b"\r" + target + b"\x1e\r" for target in targets))

    def test_every_byte_value_at_128000_baud(self):
        targets = [point(v, 255 - v, v ^ 0x55) for v in range(256)]
        frames = [frame for target in targets for frame in (b"M" + target, b"C")]
        events = spaced(READY_US, 10_000, frames)
        end = events[-1][0] + 10_000
        sent = between(run("mpc", events + [(end, "stop")]), READY_US, end)
        self.assertEqual(sent, b"".join(b"\r\x01" + target + b"\r" for target in targets))

    def test_interrupt_is_answered_within_2_ms_of_its_arrival(self):
        asked = [READY_US + 100_003, READY_US + 200_009, READY_US + 300_017]
        sent = run("trio", [(READY_US, b"S\x00" + point(266667, 266667, 266667)), *((us, b"\x03") for us in asked),
                            (READY_US + 400_000, "stop")])
        answered = [us for us, byte in sent]
        self.assertEqual([byte for _, byte in sent], [13, 13, 13])
        for begin, end in zip(asked, answered):
            self.assertLessEqual(end - begin, 2000)

    def test_a_reply_takes_the_time_of_its_bytes(self):
        for controller, ask, byte_us in (("trio", b"c", 173), ("mpc", b"C", 78)):
            with self.subTest(controller):
                sent = run(controller, [(READY_US, ask), (READY_US + 20_000, "stop")])
                self.assertEqual(len(sent), 14)
                # From the command's arrival on; USB packets and simavr's own UART make it longer, never shorter.
                self.assertGreaterEqual(sent[-1][0] - READY_US, 13 * byte_us)
                self.assertLessEqual(sent[-1][0] - READY_US, 14 * byte_us * 5 // 4 + 1500)


class Stream(unittest.TestCase):
    def stream(self, level, noise=b"", more=()):
        target = point(16_000, 8_000, 0)  # 1,000 um in X
        begin = READY_US + 100_000
        noises = [(begin + 50_000 + i * 10_000, noise) for i in range(60)] if noise else []
        events = [(READY_US, b"O"), (READY_US + 20_000, b"S"), (READY_US + 60_000, bytes([level])), (begin, target), *noises,
                  *more, (begin + 1_600_000, b"C"), (begin + 1_650_000, "stop")]
        return [(us, byte) for us, byte in run("mpc", sorted(events)) if us >= begin]

    def frames(self, sent):
        """The moment of each frame's first byte, and its X; then the bytes after the last frame."""
        data = bytes(byte for _, byte in sent)
        at, frames = 0, []
        while data[at:at + 3] == b"\xff\xff\xff":
            frames.append((sent[at][0], int.from_bytes(data[at + 3:at + 6], "little")))
            at += 12
        return frames, data[at:], at

    def test_at_speed_15_the_line_stays_full_and_no_frame_is_late_by_more_than_its_own_time(self):
        sent = self.stream(15)
        frames, rest, count = self.frames(sent)
        self.assertEqual(rest, b"\r\x01" + point(16_000, 8_000, 0) + b"\r")
        gaps = sorted(b - a for (a, _), (b, _) in zip(sent[:count], sent[1:count]))
        typical = gaps[len(gaps) // 2]
        frame_us = (frames[-1][0] - frames[0][0]) / (len(frames) - 1)
        if not IS_USB:  # a UART: byte follows byte
            self.assertLessEqual(sum(gaps), typical * len(gaps) * 103 // 100)
            self.assertLessEqual(frame_us, typical * 12 * 103 // 100)
        else:  # packets: as many frames as the line would have carried
            self.assertGreaterEqual(len(frames), 769_231 * 128_000 // 120 // 1_000_000 * 98 // 100)
        # 16 steps a um at 1,300 um/s: when each position was reached, against when its frame began to leave.
        late = [us - x * 1_000_000 / (16 * 1300) for us, x in frames]
        # USB: a packet a millisecond, which the simulated computer fetches within an eighth of one.
        self.assertLessEqual(max(late) - min(late), frame_us + (1125 if IS_USB else 0))

    def test_at_a_slow_speed_every_micron_is_told(self):
        # 7.8 kB/s; from 12 on a line of 125000 baud is too slow. From 10 on it depends on where in its round the loop is
        # whether the last frame still finds the one before it on the line when the move ends, and is left out.
        sent = self.stream(7)
        frames, rest, _ = self.frames(sent)
        self.assertEqual([x for _, x in frames], [16 * k for k in range(1, 1001)])
        self.assertEqual(rest[:1], b"\r")

    def test_no_byte_is_lost_while_streaming(self):
        # 60 bursts of 40 bytes that no command begins with; among them four whole moves, at the line's full rate.
        moves = [point(16_000 + 160 * k, 8_000, 0) for k in (1, 2, 3, 4)]
        burst = b"\xee" * 40 + b"".join(b"M" + move for move in moves) + b"\x22" * 40
        begin = READY_US + 100_000
        sent = self.stream(15, noise=b"\xee\x22" * 20, more=[(begin + 305_000, burst)])
        _, rest, _ = self.frames(sent)
        self.assertEqual(rest, b"\r" * 5 + b"\x01" + moves[-1] + b"\r")


class Straps(unittest.TestCase):
    def answer(self, controller, straps, ask):
        sent = run(controller, [(READY_US, ask), (READY_US + 50_000, "stop")], straps=straps)
        return bytes(byte for us, byte in sent if us >= READY_US)

    def test_each_strap(self):
        self.assertEqual(self.answer("trio", [0], b"U"), b"\x02\x01\x01\x00\x00\r")
        self.assertEqual(self.answer("mpc", [0], b"c"), point(10667, 10667, 10667) + b"\x1e\r")
        self.assertEqual(self.answer("trio", [2], b"c"), point(8000, 8000, 8000) + b"\x1e\r")  # MP-285: 8 steps a um
        self.assertEqual(self.answer("mpc", [1, 2], b"U"), b"\x04\x01\x01\x01\x01\r")

    def test_switch_6_is_none(self):
        there = point(1, 2, 3)
        with tempfile.TemporaryDirectory() as temporary:
            memory = str(Path(temporary, "memory"))
            run("trio", [(READY_US, b"S\x0f" + there), (READY_US + 2_000_000, "off")], memory, straps=[3])
            sent = run("trio", [(READY_US, b"c"), (READY_US + 50_000, "stop")], memory, straps=[3])
            self.assertEqual(between(sent, 0, READY_US + 50_000), there + b"\x1e\r")


class Memory(unittest.TestCase):
    def test_an_mpc_is_where_it_was_after_a_power_cut_at_any_moment(self):
        """The move ends at about READY + 34 ms, its record is written from a second later on; one byte takes 3.4 ms."""
        there = point(1600, 800, 400)
        with tempfile.TemporaryDirectory() as temporary:
            seen = set()
            for cut_us in (500_000, 1_030_000, 1_040_000, 1_060_000, 1_100_000, 1_200_000, 1_300_000, 1_400_000, 1_600_000):
                memory = str(Path(temporary, f"{cut_us}"))
                run("mpc", [(READY_US, b"M" + there), (READY_US + cut_us, "off")], memory)
                answer = between(run("mpc", [(READY_US, b"C"), (READY_US + 50_000, "stop")], memory), READY_US, READY_US + 50_000)
                with self.subTest(cut_us=cut_us):
                    self.assertIn(answer, (b"\x01" + point(0, 0, 0) + b"\r", b"\x01" + there + b"\r"))
                seen.add((answer[1:13], cut_us >= 1_600_000))
            self.assertIn((point(0, 0, 0), False), seen)
            self.assertIn((there, True), seen)


if __name__ == "__main__":
    unittest.main()
