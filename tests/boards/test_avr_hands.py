"""Buttons and knobs of AVR boards: the images as they are flashed, in a simulator of the chip, with pins connected to ground
and left open again in the chip's own time, contacts that bounce included.

    test_avr_hands.py AVR_BOARD IMAGES uno|mega|leonardo    (IMAGES: the directory of the board's build)

What is expected is typed from the manuals' first pages and PROTOCOL.md; pins are those of docs/boards.md. In microseconds from
the board's start.
"""
import sys
import tempfile
import unittest
from pathlib import Path

import images
from images import between, point

RUNNER, IMAGES, BOARD = (sys.argv.pop(1) for _ in range(3))
MCU = {"uno": "atmega328p", "mega": "atmega2560", "leonardo": "atmega32u4"}[BOARD]
USB = ["--usb"] if BOARD == "leonardo" else []
# Arduino's pins as pins of the chip (the boards' circuit diagrams).
PINS = {
    "uno": {"D6": "D6", "D7": "D7", "D8": "B0", "D9": "B1", "D10": "B2", "D11": "B3", "A0": "C0", "A1": "C1", "A2": "C2",
            "A3": "C3", "A4": "C4", "A5": "C5", "D12": "B4", "D13": "B5"},
    "mega": {"D6": "H3", "D7": "H4", "D8": "H5", "D9": "H6", "D10": "B4", "D11": "B5", "A0": "F0", "A1": "F1", "A2": "F2",
             "A3": "F3", "A4": "F4", "A5": "F5", "A8": "K0", "A9": "K1", "A10": "K2", "A11": "K3", "D12": "B6", "D13": "B7"},
    "leonardo": {"D6": "D7", "D7": "E6", "D8": "B4", "D9": "B5", "D10": "B6", "D11": "B7", "A0": "F7", "A1": "F6", "A2": "F5",
                 "A3": "F4", "A4": "F1", "A5": "F0", "D12": "D6", "D13": "C7"},
}[BOARD]
HOME, WORK, PULSE, RELATIVE, SPEED, MAINS = "D6", "D7", "D8", "D9", "D10", "D11"
STOP, DIAGONAL, CALIBRATE, MANIPULATOR = "D8", "D9", "D10", "D11"
X, Y, Z = ("A0", "A1"), ("A2", "A3"), ("A4", "A5")
D = MANIPULATOR_KNOB = ("A8", "A9")
MODE = ("A10", "A11")
BUZZER, LED = "D12", "D13"

READY_US = 2_500_000  # a TRIO has calibrated
AT_1000_UM = point(10667, 10667, 10667)
MS = 1000


def bouncing(us, pin, closed):
    """The contact changes, and chatters for 5 ms."""
    change, back = ("low", "open") if closed else ("open", "low")
    return [(us + after, f"{what} {PINS[pin]}")
            for after, what in ((0, change), (300, back), (500, change), (1900, back), (2600, change), (4700, back), (5000, change))]


def press(us, pin, for_us=100 * MS):
    return bouncing(us, pin, True) + bouncing(us + for_us, pin, False)


def turn(us, knob, detents, quarter_us=4 * MS):
    """Detents of an encoder, each a cycle of its two contacts; each edge chatters for a quarter of the time to the next."""
    a, b = knob if detents > 0 else knob[::-1]
    events = []
    for i in range(abs(detents)):
        for j, (pin, closed) in enumerate(((a, True), (b, True), (a, False), (b, False))):
            at = us + (4 * i + j) * quarter_us
            change, back = ("low", "open") if closed else ("open", "low")
            events += [(at, f"{change} {PINS[pin]}"), (at + quarter_us // 8, f"{back} {PINS[pin]}"),
                       (at + quarter_us // 4, f"{change} {PINS[pin]}")]
    return events


def run(controller, events, memory=None, pins=None):
    events = sorted(events, key=lambda event: event[0])
    options = [*USB, *(["--memory", memory] if memory else []), "--watch", PINS[BUZZER] + PINS[LED], "--script", "-"]
    return images.run([RUNNER, *options, MCU, str(Path(IMAGES, f"{BOARD}-{controller}-hands.elf"))], events, pins)


def ask(controller, events, asks, memory=None, pins=None):
    """What is answered to each of the commands: a list of (us, bytes), up to the next one; the last one has 60 ms."""
    ends = [us for us, _ in asks[1:]] + [asks[-1][0] + 60 * MS]
    sent = run(controller, events + asks + [(ends[-1], "stop")], memory, pins)
    return [between(sent, us, end) for (us, _), end in zip(asks, ends)]


class Trio(unittest.TestCase):
    def test_home_moves_home_without_a_cr(self):
        at = READY_US
        before, after = ask("trio", press(at, HOME), [(at + 50 * MS, b"c"), (at + 900 * MS, b"c")])
        self.assertEqual((before, after), (AT_1000_UM + b"\x1e\r", point(0, 0, 0) + b"\x1e\r"))

    def test_home_pauses_and_resumes_a_hosts_h(self):
        at = READY_US
        events = press(at + 100 * MS, HOME, 50 * MS) + press(at + 1_100 * MS, HOME, 50 * MS)
        answers = ask("trio", events, [(at, b"h"), (at + 1_500 * MS, b""), (at + 1_700 * MS, b"c")])
        # 600 ms of way, and one second of pause in it.
        self.assertEqual(answers, [b"", b"\r", point(0, 0, 0) + b"\x1e\r"])

    def test_work_held_3_s_stores_the_place_and_beeps_once(self):
        at, pins = READY_US, []
        there = point(12000, 11000, 10000)
        answers = ask("trio", press(at + 100 * MS, WORK, 3_050 * MS) + press(at + 4_500 * MS, WORK),
                      [(at, b"S\x0f" + there), (at + 3_300 * MS, b"h"), (at + 5_400 * MS, b"c")], pins=pins)
        self.assertEqual(answers, [b"\r", b"\r", there + b"\x1e\r"])
        beep = [(us, level) for us, pin, level in pins if pin == PINS[BUZZER]]
        self.assertEqual([level for _, level in beep], [1, 0])
        self.assertAlmostEqual(beep[0][0], at + 3_100 * MS + 11 * MS, delta=4 * MS)  # 8 looks the same, and the chatter
        self.assertAlmostEqual(beep[1][0] - beep[0][0], 100 * MS, delta=2 * MS)

    def test_work_held_too_short_is_a_press_and_stores_nothing(self):
        at, pins = READY_US, []
        answers = ask("trio", press(at, WORK, 2_950 * MS), [(at + 3_100 * MS, b"x\0\0\0\0"), (at + 3_400 * MS, b"w"),
                                                           (at + 3_800 * MS, b"c")], pins=pins)
        self.assertEqual(answers, [b"\r", b"\r", point(0, 10667, 10667) + b"\x1e\r"])
        self.assertNotIn(PINS[BUZZER], [pin for _, pin, _ in pins])

    def test_a_bouncing_press_counts_once(self):
        # SPEED from 0 to 1: a detent is 16 microsteps, not 64 (none) or 4 (twice).
        at = READY_US
        answer, = ask("trio", press(at, SPEED) + turn(at + 200 * MS, X, 1), [(at + 300 * MS, b"c")])
        self.assertEqual(answer, point(10667 + 16, 10667, 10667) + b"\x1e\r")

    def test_each_knob_moves_its_axis_both_ways(self):
        at = READY_US
        events = turn(at, X, 5) + turn(at + 200 * MS, Y, -4) + turn(at + 400 * MS, Z, 3) + turn(at + 600 * MS, X, -2)
        answers = ask("trio", events, [(at + 150 * MS, b"c"), (at + 350 * MS, b"c"), (at + 550 * MS, b"c"), (at + 750 * MS, b"c")])
        places = [(5, 0, 0), (5, -4, 0), (5, -4, 3), (3, -4, 3)]
        self.assertEqual(answers, [point(*(10667 + 64 * n for n in place)) + b"\x1e\r" for place in places])

    def test_a_knob_turned_fast_loses_no_detent(self):
        at = READY_US
        answer, = ask("trio", turn(at, X, 40, quarter_us=1_500), [(at + 400 * MS, b"c")])
        self.assertEqual(answer, point(10667 + 64 * 40, 10667, 10667) + b"\x1e\r")

    def test_lock_and_the_leds_red(self):
        at, pins = READY_US, []
        events = press(at, SPEED, 3_050 * MS) + turn(at + 3_200 * MS, X, 5)
        answer, = ask("trio", events, [(at + 3_400 * MS, b"c")], pins=pins)
        self.assertEqual(answer, AT_1000_UM + b"\x1e\r")
        led = [(us, level) for us, pin, level in pins if pin == PINS[LED] and us > at]
        self.assertEqual([level for _, level in led], [1])
        self.assertAlmostEqual(led[0][0], at + 3_011 * MS, delta=4 * MS)

    def test_the_mains_switch(self):
        # Off: silence. On again: it calibrates, which takes 0.8 s, and answers then.
        at = READY_US
        events = turn(at, X, 5) + press(at + 200 * MS, MAINS) + press(at + 500 * MS, MAINS)
        answers = ask("trio", events, [(at + 400 * MS, b"c"), (at + 600 * MS, b"c"), (at + 1_250 * MS, b""), (at + 1_400 * MS, b"")])
        self.assertEqual(answers, [b"", b"", AT_1000_UM + b"\x1e\r", b""])

    def test_what_is_stored_by_hand_outlives_power(self):
        at = READY_US
        with tempfile.TemporaryDirectory() as temporary:
            memory = str(Path(temporary, "memory"))
            run("trio", turn(at, X, 10) + press(at + 300 * MS, WORK, 3_050 * MS) + [(at + 5_200 * MS, "off")], memory)
            answers = ask("trio", [], [(at, b"w"), (at + 300 * MS, b"c")], memory)
        self.assertEqual(answers, [b"\r", point(10667 + 640, 10667, 10667) + b"\x1e\r"])

    @unittest.skipIf(BOARD != "mega", "no pins for it")
    def test_knob_d_sets_the_angle_after_pulse_was_held(self):
        at = READY_US
        answer, = ask("trio", press(at, PULSE, 3_050 * MS) + turn(at + 3_200 * MS, D, 15), [(at + 3_600 * MS, b"c")])
        self.assertEqual(answer, AT_1000_UM + b"\x2d\r")


class Mpc(unittest.TestCase):
    def test_stop_ends_a_hosts_move_with_its_one_cr(self):
        at = READY_US
        pressed = at + 200 * MS
        sent = run("mpc", press(pressed, STOP) + [(at, b"M" + point(48000, 0, 0)), (at + 400 * MS, b"C"), (at + 500 * MS, "stop")])
        (us, byte), *answer = [(us, byte) for us, byte in sent if us > at]
        self.assertEqual(byte, 13)
        self.assertTrue(pressed + 7 * MS <= us <= pressed + 15 * MS, us - pressed)  # 8 looks the same, and the chatter
        x = int.from_bytes(bytes(byte for _, byte in answer)[1:5], "little")
        self.assertAlmostEqual(x, 3_000 * 16 * (us - at) / 1e6, delta=3_000 * 16 * 0.004)  # 3,000 um/s, 16 steps a um

    def test_stop_and_work_store_a_place_and_home_and_work_go(self):
        at = READY_US
        there = point(8000, 4000, 1600)
        events = press(at + 300 * MS, STOP, 400 * MS) + press(at + 400 * MS, WORK) + press(at + 900 * MS, HOME) + \
            press(at + 1_500 * MS, WORK)
        answers = ask("mpc", events, [(at, b"M" + there), (at + 800 * MS, b"C"), (at + 1_400 * MS, b"C"), (at + 2_000 * MS, b"C")])
        self.assertEqual(answers, [b"\r", b"\x01" + there + b"\r", b"\x01" + point(0, 0, 0) + b"\r", b"\x01" + there + b"\r"])

    def test_manipulator_changes_k_and_who_moves(self):
        at = READY_US
        events = press(at, MANIPULATOR) + turn(at + 200 * MS, Y, 1) + press(at + 500 * MS, MANIPULATOR)
        answers = ask("mpc", events, [(at + 150 * MS, b"K"), (at + 400 * MS, b"C"), (at + 700 * MS, b"K")])
        self.assertEqual(answers, [b"\x02\x21\x03\r", b"\x02" + point(0, 64, 0) + b"\r", b"\x01\x21\x03\r"])

    def test_work_held_2_s_locks(self):
        at = READY_US
        answers = ask("mpc", press(at, WORK, 2_050 * MS) + turn(at + 2_200 * MS, X, 5),
                      [(at + 2_400 * MS, b"C"), (at + 2_500 * MS, b"M" + point(16, 0, 0)), (at + 2_600 * MS, b"C")])
        self.assertEqual(answers, [b"\x01" + point(0, 0, 0) + b"\r", b"\r", b"\x01" + point(16, 0, 0) + b"\r"])

    def test_diagonal_lights_its_led_and_knob_z_moves_two_axes(self):
        at, pins = READY_US, []
        answer, = ask("mpc", press(at, DIAGONAL) + turn(at + 200 * MS, Z, 10), [(at + 500 * MS, b"C")], pins=pins)
        x, y, z = (int.from_bytes(answer[i:i + 4], "little") for i in (1, 5, 9))
        self.assertEqual(y, 0)
        self.assertTrue(0 < z < x, (x, z))  # 29 degrees: less steep than 45
        self.assertEqual([level for us, pin, level in pins if pin == PINS[LED] and us > at], [1])

    @unittest.skipIf(BOARD != "mega", "no pins for it")
    def test_mode_and_manipulator_by_encoder(self):
        at = READY_US
        events = turn(at, MODE, 1) + turn(at + 100 * MS, X, 1) + turn(at + 200 * MS, MANIPULATOR_KNOB, 1)
        answers = ask("mpc", events, [(at + 150 * MS, b"C"), (at + 300 * MS, b"K")])
        self.assertEqual(answers, [b"\x01" + point(256, 0, 0) + b"\r", b"\x02\x21\x03\r"])


if __name__ == "__main__":
    unittest.main()
