"""The guard as an image for the Mega 2560, as it is flashed, in a simulator of the chip (avr_board), between a script and an
emulated controller (avr_controller.h), in the chip's own time.

    test_bridge_avr.py AVR_BOARD IMAGE DRYRIG_GUARD

Configurations are compiled by dryrig-guard and lie in the EEPROM as docs/boards.md tells. What is expected comes from the rules
of dr_guard.h and bridge_port.h. Times are microseconds of the board's clock from its start.
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from images import point

RUNNER, IMAGE, GUARD = (sys.argv.pop(1) for _ in range(3))
# Inputs and outputs as pins of the chip: D6 to D11, A0 to A3; D12, D13, D22 (the board's circuit diagram).
STOP, STOP_2, KEY, ARM, CONFIRM, HOST = "H3", "H4", "H5", "H6", "F2", "F3"
BUZZER, LAMP, RELAY = "B6", "B7", "A0"
AT_REST = STOP + STOP_2 + HOST  # the stop contacts are closed, a host is there
HALF = 2048  # of the EEPROM: where the second configuration lies
IMAGE_BYTES = 1555
BYTE_US = {"trio": 174, "mpc": 80}
HERE = point(20000, 20000, 20000)  # where the tip is at the start
EVENT_START, EVENT_REFUSED, EVENT_STOP = 0, 3, 9  # dr_event

CONFIGURATION = {
    "trio": """format = 1; revision = %(revision)d; profile = "trio-mp245a"; firmware = "3.12";
        external_switch5_on = true; external_switch6_on = false; %(more)s
        drives = ({ number = 1; device = "MP-845"; microstep_um = 0.09375; max_move_um = 5000;
                    box_um = { x = (100, 24900); y = (100, 24900); z = (100, 20000); }; });
        keepouts = (%(keepouts)s);""",
    "mpc": """format = 1; revision = %(revision)d; profile = "mpc-200"; firmware = "3.21"; %(more)s
        drives = ({ number = 1; device = "MP-225"; microstep_um = 0.0625; switch8_on = true; max_move_um = 5000;
                    box_um = { x = (100, 24900); y = (100, 24900); z = (100, 20000); }; });
        keepouts = (%(keepouts)s);""",
}
FLOOR = '{ name = "o%d"; drive = 1; half = { normal = (1, %d, -1000); through_um = (0, 0, %d); }; }'
OBJECTIVE = '{ name = "o%d"; drive = 1; box_um = { x = (9000, 16000); y = (9000, 16000); z = (%d, %d); }; }'



def compiled(controller="trio", revision=7, more="", boxes=1, floors=0):
    keepouts = ",".join([OBJECTIVE % (i, 12000 * i // boxes, 12000 * (i + 1) // boxes - 100) for i in range(boxes)] +
                        [FLOOR % (boxes + i, i, 19500 - i) for i in range(floors)])
    with tempfile.TemporaryDirectory() as temporary:
        text, image = Path(temporary, "rig.conf"), Path(temporary, "rig.bin")
        text.write_text(CONFIGURATION[controller] % {"revision": revision, "more": more, "keepouts": keepouts})
        subprocess.run([GUARD, "compile", text, "-o", image], check=True, stdout=subprocess.PIPE)
        return image.read_bytes()


def eeprom(first=b"", second=b""):
    return first.ljust(HALF, b"\xff") + second.ljust(HALF, b"\xff")


class Run:
    """What happened in a run: times in us."""

    def __init__(self, text):
        lines = [line.split() for line in text.splitlines()]
        self.to_host = [(int(us), int(what, 16)) for us, what in (line for line in lines if len(line) == 2) if what[0] not in "<>#"]
        self.to_controller = [(int(line[0]), int(line[1][1:], 16)) for line in lines if len(line) == 2 and line[1][0] == ">"]
        records = [(line[0], line[1].rpartition("#")[2]) for line in lines if len(line) == 2 and line[1][0] == "#"]
        self.log = [(int(us), bytes.fromhex(record)) for us, record in records if len(record) == 96]  # a reset cuts one off
        self.pins = [(int(line[0]), line[1], int(line[2])) for line in lines if len(line) == 3]
        self.took = [(int(line[0]), int(line[3]) if line[2] == "after" else None) for line in lines if line[1] == "^C"]
        self.tip = next(point(*map(int, line[2:])) for line in lines if line[1] == "tip")

    def host_got(self, since=0):
        return bytes(byte for us, byte in self.to_host if us >= since)

    def controller_got(self, since=0, until=1 << 40):
        return bytes(byte for us, byte in self.to_controller if since <= us < until)

    def records(self, event):
        return [(us, record) for us, record in self.log if record[8] == event]

    def level(self, pin, us):
        return next((level for when, name, level in reversed(self.pins) if name == pin and when <= us), 0)


def run(events, memory, controller="trio", watch=LAMP + BUZZER, low=AT_REST + KEY):
    script = "".join(f"{us} {what if isinstance(what, str) else what.hex(' ')}\n" for us, what in sorted(events, key=lambda e: e[0]))
    with tempfile.TemporaryDirectory() as temporary:
        path = Path(temporary, "eeprom")
        path.write_bytes(memory)
        done = subprocess.run([RUNNER, "--controller", controller, "--memory", path, "--low", low, "--watch", watch,
                               "--script", "-", "atmega2560", IMAGE],
                              input=script, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=800)
    if done.returncode:
        raise AssertionError(done.stderr)
    return Run(done.stdout)


def press(pin, us):
    return [(us, f"low {pin}"), (us + 100_000, f"open {pin}")]


def line(level, x, y, z):
    return b"S" + bytes([level]) + point(x, y, z)


PROVED = 1_200_000  # a second after the start, and the reply
ARMED = 1_600_000
TO_ARM = press(ARM, 1_300_000)
SLOW = line(0, 24000, 20000, 20000)  # 375 um: takes 1.2 s (an MPC-200: 250 um, 3 s)


class Talk(unittest.TestCase):
    def test_the_controller_is_proved_and_queries_pass_unchanged(self):
        got = run([(PROVED, b"c"), (PROVED + 50_000, b"C"), (PROVED + 100_000, "stop")], eeprom(compiled()))
        first_us, first = got.to_controller[0]
        self.assertEqual(first, ord("c"))
        self.assertGreaterEqual(first_us, 1_000_000)  # "ready about one second after power-on"
        self.assertEqual(got.controller_got(PROVED), b"cC")
        self.assertEqual(got.host_got(), (HERE + b"\x1e\r") * 2)
        start = got.log[0][1]
        self.assertEqual((start[8], start[11]), (EVENT_START, 0))
        self.assertEqual(int.from_bytes(start[36:40], "little"), 7)  # the revision

    def test_without_a_configuration_nothing_leaves_and_nothing_is_answered(self):
        got = run([(PROVED, b"c"), (PROVED + 50_000, b"\x03"), *TO_ARM, (ARMED, SLOW), (ARMED + 300_000, "stop")], eeprom())
        self.assertEqual((got.controller_got(), got.host_got(), got.tip), (b"", b"", HERE))

    def test_a_move_passes_whole_and_unchanged_when_armed_and_not_before(self):
        move = line(15, 20256, 20003, 20013)
        got = run([(PROVED, move), *TO_ARM, (ARMED, move), (ARMED + 500_000, "stop")], eeprom(compiled()))
        self.assertNotIn(b"S", got.controller_got(0, ARMED))
        self.assertEqual(got.controller_got(ARMED), b"c" + move + b"c")  # its own query before, and after the end
        self.assertEqual(got.host_got(), b"\r")
        self.assertEqual(got.tip, move[2:])
        self.assertEqual(len(got.records(EVENT_REFUSED)), 1)

    def test_a_move_of_an_mpc_is_paused_within(self):
        move = line(15, 20256, 20003, 20013)
        got = run([*TO_ARM, (ARMED, b"K"), (ARMED + 50_000, move), (ARMED + 500_000, "stop")], eeprom(compiled("mpc")), "mpc")
        self.assertEqual(got.controller_got(ARMED), b"KC" + move + b"C")
        self.assertEqual(got.host_got(), b"\x01\x21\x03\r\r")
        head = next(us for us, byte in got.to_controller if byte == move[0])
        rest = [us for us, byte in got.to_controller if us > head][1]
        self.assertGreaterEqual(rest - head, 30_000)

    def test_moves_outside_the_box_or_through_an_obstacle_get_silence(self):
        outside, through = line(15, 20000, 20000, 500), line(15, 20000, 20000, 20000 + 53_400)
        got = run([*TO_ARM, (ARMED, outside), (ARMED + 200_000, through), (ARMED + 400_000, b"c"), (ARMED + 500_000, "stop")],
                  eeprom(compiled()))
        self.assertEqual(got.controller_got(ARMED), b"ccc")
        self.assertEqual(got.host_got(), HERE + b"\x1e\r")
        self.assertEqual(len(got.records(EVENT_REFUSED)), 2)

    def test_obstacles_are_judged_in_time_and_too_many_refuse(self):
        move = line(15, 20256, 20003, 20013)
        for boxes, floors, tip in ((24, 0, move[2:]), (1, 4, move[2:]), (1, 31, HERE)):
            with self.subTest(boxes=boxes, floors=floors):
                got = run([*TO_ARM, (ARMED, move), (ARMED + 1_400_000, "stop")], eeprom(compiled(boxes=boxes, floors=floors)))
                self.assertEqual(got.tip, tip)
                self.assertEqual(len(got.records(EVENT_REFUSED)), 0 if tip != HERE else 1)
                self.assertEqual(len(got.records(EVENT_START)), 1)

    def test_a_flood_of_nonsense_moves_nothing_and_wakes_no_watchdog(self):
        noise = bytes((i * 73 + 11) % 251 for i in range(2000))
        got = run([*TO_ARM, (ARMED, noise), (ARMED + 600_000, b"c"), (ARMED + 700_000, "stop")], eeprom(compiled()))
        self.assertEqual(len(got.records(EVENT_START)), 1)
        self.assertEqual(set(got.controller_got(ARMED)) - set(b"cC\x03"), set())
        self.assertEqual(got.tip, HERE)
        self.assertEqual(got.host_got(ARMED + 600_000)[-14:], HERE + b"\x1e\r")

    def test_the_log_is_a_chain(self):
        got = run([(PROVED, SLOW), *TO_ARM, (ARMED, SLOW), (ARMED + 300_000, b"\x03"), (ARMED + 900_000, "stop")],
                  eeprom(compiled()))
        with tempfile.NamedTemporaryFile("w", suffix=".log") as log:
            log.write("".join(f"#{record.hex()}\n" for _, record in got.log))
            log.flush()
            done = subprocess.run([GUARD, "log", log.name], stdout=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.stdout, r"whole, \d+ records of 1 starts")


class Stop(unittest.TestCase):
    def moving(self, events, end=ARMED + 1_000_000):
        return run([*TO_ARM, (ARMED, SLOW), *events, (end, "stop")], eeprom(compiled()))

    def sweep(self, what, controller, first, last, byte_us, before=(), more=""):
        """How long a stop takes, to its first bit, that is asked for at any instant of a move. us since the host's frame."""
        step = 173  # in 200 ms every place of a round, and of what a timer of the guard does before it, some times
        got = run([*TO_ARM, *before, (ARMED, SLOW), (ARMED + first, f"sweep {ARMED + last} {step} {what}"),
                   (ARMED + last + 1000, "stop")], eeprom(compiled(controller, more=more)), controller)
        self.assertEqual(len(got.took), len(range(first, last, step)))
        self.assertEqual([us for us, took in got.took if took is None], [])
        return sorted(took - byte_us for _, took in got.took)

    def test_a_stop_is_on_the_wire_within_a_millisecond_at_every_moment_of_a_move(self):
        # From the last byte of the frame on; timers of the guard run out 50 and 100 ms behind it.
        for controller, first in (("trio", 22_000), ("mpc", 53_000)):
            for what in ("03", f"open {STOP}", f"open {STOP_2}", f"open {STOP}{STOP_2}"):
                with self.subTest(controller, what=what):
                    took = self.sweep(what, controller, first, first + 200_000, BYTE_US[controller] if what == "03" else 0)
                    self.assertLessEqual(took[len(took) // 2], 700)
                    self.assertLessEqual(took[-1], 1000)

    def test_positions_that_stream_do_not_hold_a_stop_up(self):
        for what in ("03", f"open {STOP}{STOP_2}"):
            with self.subTest(what=what):
                took = self.sweep(what, "mpc", 53_000, 103_000, BYTE_US["mpc"] if what == "03" else 0,
                                  [(ARMED - 100_000, b"O")], "allow_stream = true;")
                self.assertLessEqual(took[-1], 1000)

    def test_an_interrupt_stops_the_move_and_is_answered(self):
        for asked in range(ARMED + 45_000, ARMED + 45_300, 97):
            got = self.moving([(asked, b"\x03")], asked + 250_000)
            self.assertEqual(got.controller_got(asked)[:1], b"\x03")
            self.assertEqual(got.host_got(), b"\r")
            self.assertNotEqual(got.tip, SLOW[2:])

    def test_each_stop_contact_stops_at_once_and_stays(self):
        for contact in (STOP, STOP_2):
            with self.subTest(contact):
                asked = ARMED + 300_000
                got = self.moving([(asked, f"open {contact}"), (asked + 400_000, f"low {contact}"),
                                   *press(ARM, asked + 450_000), (asked + 600_000, SLOW)])
                sent = next(us for us, byte in got.to_controller if us > asked)
                self.assertLessEqual(sent - asked, 1000)
                # Rest is proved; released, it moves nothing, and neither ARM nor the host changes that.
                self.assertEqual(set(got.controller_got(asked)), set(b"\x03c"))
                self.assertEqual(got.host_got(), b"")

    def test_after_a_stop_key_and_arm_are_needed_anew(self):
        asked = ARMED + 200_000
        back = line(15, 20000, 20000, 20000)
        events = [(asked, f"open {STOP}{STOP_2}"), (asked + 300_000, f"low {STOP}{STOP_2}"), (asked + 350_000, f"open {KEY}"),
                  (asked + 400_000, f"low {KEY}"), *press(ARM, asked + 450_000), (asked + 750_000, back),
                  (asked + 1_000_000, "stop")]
        got = run([*TO_ARM, (ARMED, SLOW), *events], eeprom(compiled()))
        self.assertEqual((got.host_got(asked + 750_000), got.tip), (b"\r", HERE))

    def test_key_and_host_that_go_stop_a_move(self):
        for pin in (KEY, HOST):
            with self.subTest(pin):
                asked = ARMED + 300_000
                got = self.moving([(asked, f"open {pin}")])
                self.assertEqual(got.controller_got(asked)[:1], b"\x03")
                self.assertNotEqual(got.tip, SLOW[2:])
                self.assertEqual(got.host_got(), b"")

    def test_a_move_that_cannot_be_stopped_sounds_the_buzzer_until_it_ends(self):
        move = b"x" + (20000 + 10_000).to_bytes(4, "little")  # 937.5 um at 5 mm/s: 188 ms
        asked = ARMED + 100_000
        got = run([*TO_ARM, (ARMED, move), (asked, f"open {STOP}{STOP_2}"), (asked + 800_000, "stop")], eeprom(compiled()))
        self.assertEqual(got.level(BUZZER, asked), 0)
        self.assertEqual(got.level(BUZZER, asked + 50_000), 1)
        self.assertEqual(got.tip[:4], move[1:])


class People(unittest.TestCase):
    def moved(self, events, memory=None, **more):
        return run([*events, (2_500_000, SLOW), (2_900_000, "stop")], memory or eeprom(compiled()), **more).tip != HERE

    def test_arm_takes_a_key_and_an_edge(self):
        self.assertTrue(self.moved(press(ARM, 2_000_000)))
        self.assertFalse(self.moved([]))
        self.assertFalse(self.moved(press(ARM, 2_000_000), low=AT_REST))  # no key
        self.assertFalse(self.moved([(1_500_000, f"low {ARM}"), (1_700_000, f"low {KEY}")], low=AT_REST))  # no edge
        self.assertFalse(self.moved([], low=AT_REST + KEY + ARM))  # held at power-up
        self.assertTrue(self.moved([(1_900_000, f"open {ARM}"), (2_000_000, f"low {ARM}")], low=AT_REST + KEY + ARM))
        self.assertFalse(self.moved(press(ARM, 500_000)))  # before the controller is proved

    def test_contacts_that_bounce_are_one_press(self):
        # ARM without the key; then the key is turned on and ARM let go: its bouncing must not count as a press.
        bounces = [(1_800_000 + i * 500, f"{'low' if i % 2 else 'open'} {ARM}") for i in range(9)]
        self.assertFalse(self.moved([(1_400_000, f"low {ARM}"), (1_600_000, f"low {KEY}"), *bounces], low=AT_REST))

    def test_the_lamp_tells(self):
        got = run([*TO_ARM, (2_500_000, "stop")], eeprom(compiled()))
        self.assertEqual(got.level(LAMP, 2_000_000), 1)
        self.assertEqual([level for us, pin, level in got.pins if pin == LAMP and us > ARMED], [])  # steady
        flashes = [us for us, pin, level in run([(3_500_000, "stop")], eeprom()).pins if pin == LAMP and level == 1]
        self.assertGreaterEqual(len(flashes), 2)  # once, and a pause: fault 1, no limits
        self.assertTrue(all(b - a > 1_200_000 for a, b in zip(flashes, flashes[1:])))


class Memory(unittest.TestCase):
    def started(self, memory, more=(), until=PROVED):
        got = run([*more, (until, "stop")], memory)
        start = got.records(EVENT_START)[0][1]
        return int.from_bytes(start[36:40], "little"), got

    def test_the_newer_of_two_configurations_counts(self):
        old, new = compiled(revision=7), compiled(revision=8)
        self.assertEqual(self.started(eeprom(old, new))[0], 8)
        self.assertEqual(self.started(eeprom(new, old))[0], 8)
        self.assertEqual(self.started(eeprom(b"", new))[0], 8)

    def test_a_damaged_one_leaves_the_other_which_somebody_must_confirm(self):
        old, new = compiled(revision=7), bytearray(compiled(revision=8))
        new[700] ^= 0x10
        memory = eeprom(bytes(new), old)
        end = [(ARMED, SLOW), (ARMED + 1_400_000, "stop")]
        self.assertEqual(self.started(memory)[0], 7)
        self.assertEqual(run([*TO_ARM, *end], memory).tip, HERE)
        confirmed = run([*press(CONFIRM, 1_200_000 - 150_000), *TO_ARM, *end], memory)
        self.assertEqual(confirmed.tip, SLOW[2:])

    def test_two_damaged_ones_are_none(self):
        image = bytearray(compiled())
        for at in (0, 8, IMAGE_BYTES - 1):
            image[at] ^= 1
            revision, got = self.started(eeprom(bytes(image), bytes(image)), until=1_500_000)
            self.assertEqual((revision, got.controller_got()), (0, b""))
            image[at] ^= 1

    def test_a_bit_that_flips_in_the_limits_in_memory_is_a_reset(self):
        box = (100 * 64).to_bytes(4, "little") * 3  # its lower corner, in 1/64 um
        got = run([*TO_ARM, (ARMED, SLOW), (ARMED + 300_000, f"flip {box.hex(' ')}"), (ARMED + 900_000, "stop")],
                  eeprom(compiled()))
        self.assertEqual(len(got.records(EVENT_START)), 2)
        self.assertEqual(got.controller_got(ARMED + 300_000)[:1], b"\x03")
        self.assertNotEqual(got.tip, SLOW[2:])


class Watchdog(unittest.TestCase):
    """A program that stands still is reset within 125 ms; starting takes as long again."""

    def test_at_rest(self):
        asked = ARMED
        got = run([*TO_ARM, (asked, "hang"), (asked + 2_000_000, SLOW), (asked + 2_300_000, "stop")], eeprom(compiled()))
        starts = got.records(EVENT_START)
        self.assertEqual([record[11] for _, record in starts], [0, 1])
        after = [(us, byte) for us, byte in got.to_controller if us > asked]
        self.assertEqual(bytes(byte for _, byte in after), b"\x03c")  # and not armed any more: SLOW is refused
        self.assertLessEqual(after[0][0] - asked, 300_000)
        self.assertGreaterEqual(after[1][0] - after[0][0], 1_000_000)
        self.assertEqual(got.tip, HERE)

    def test_in_mid_move_stops_it(self):
        asked = ARMED + 300_000
        got = run([*TO_ARM, (ARMED, SLOW), (asked, "hang"), (asked + 1_500_000, "stop")], eeprom(compiled()))
        self.assertEqual(got.controller_got(asked), b"\x03c")
        at = int.from_bytes(got.tip[:4], "little")
        self.assertGreater(at, 20000)
        self.assertLess(at, 24000)

    def test_in_mid_frame_sends_nothing_until_somebody_confirms(self):
        plain = run([*TO_ARM, (ARMED, SLOW), (ARMED + 100_000, "stop")], eeprom(compiled()))
        frame = [us for us, byte in plain.to_controller if us > ARMED][1:]
        self.assertEqual(len(frame), 14)
        for part in (1, 3):  # what has been pulled by then leaves by interrupts, whatever the program does
            asked = frame[part] + 20
            got = run([*TO_ARM, (ARMED, SLOW), (asked, "hang"), (asked + 1_500_000, b"\x03c"), (asked + 3_000_000, "stop")],
                      eeprom(compiled()))
            with self.subTest(part=part):
                self.assertEqual([record[11] for _, record in got.records(EVENT_START)], [0, 2])
                sent = got.controller_got(frame[0])
                self.assertTrue(SLOW.startswith(sent), sent)
                self.assertLess(len(sent), 14)
                self.assertEqual((got.tip, got.host_got()), (HERE, b""))

    def test_the_relay_drops_when_the_program_stands_still(self):
        got = run([(PROVED, "hang"), (PROVED + 1_000_000, "stop")], eeprom(compiled()), watch=RELAY)
        waves = [us for us, pin, _ in got.pins if us < PROVED]
        self.assertLess(max(b - a for a, b in zip(waves[100:], waves[101:])), 10_000)
        gap = max(b - a for a, b in zip([us for us, *_ in got.pins], [us for us, *_ in got.pins][1:]))
        self.assertGreater(gap, 100_000)


if __name__ == "__main__":
    unittest.main()
