"""Every control, position and switch that the two manuals name, once, at a running emulator: what it does to the device, the wire
and the display. Typed from the manuals' text, page by page: [T] TRIO MP-245A, [M] MPC-325. Numbers that they do not give are
from PROTOCOL.md: an MP-845 of a TRIO starts at 10,667, 0.09375 um a microstep, 53.3 microsteps a millisecond; an MP-225 of an
MPC-200 at 0, 0.0625 um, 48 microsteps a millisecond."""
import unittest

import emu
from ctl import Rehearsal

START = 10667


class Controls(unittest.TestCase):
    KIND = None

    def begin(self, *args):
        self.e = self.enterContext(Rehearsal(self.KIND, "--clock", "step", *args))
        self.port = self.enterContext(emu.Port(self.e.path))

    def do(self, *lines):
        """Each of them, and then what it began has time to end."""
        for line in lines:
            self.e.do(line)
            if line.startswith("press"):
                self.e.do("advance 100ms")
                self.e.do("advance until idle")
            elif line.startswith("hold"):
                self.e.do("advance " + line.split()[-1])

    def ask(self, said, count, wait="10ms"):
        self.port.send(said)
        self.e.do(f"advance {wait}")
        return self.port.receive(count)

    def panel(self, *names):
        panel = self.e.do("panel")
        return tuple(panel[name] for name in names)

    def at(self):
        return self.e.position(self.e.controller()["active"])

    def moved_by(self, *lines):
        before = self.at()
        self.do(*lines)
        return [a - b for a, b in zip(self.at(), before)]


class TrioRoe(Controls):
    KIND = "trio"

    def places(self, *times):
        """Which axes move in the millisecond before each of these instants, from now on."""
        found, gone = [], 0
        for ms in times:
            self.e.do(f"advance {ms - 1 - gone}ms")
            before = self.at()
            self.e.do("advance 1ms")
            found.append("".join(name for name, a, b in zip("xyz", before, self.at()) if a != b))
            gone = ms
        return found

    # [T page 1] "HOME: Move to defined home position. Press again to pause/resume." "To set position, hold down ... until beep."
    def test_home(self):
        self.begin()
        self.do("knob x 10", "knob y 20", "hold home 3s")
        self.assertEqual(self.panel("beeps"), (1,))
        home = [START + 640, START + 1280, START]
        self.assertEqual(self.e.controller()["home_steps"], home)
        self.do("set position 1 20000,20000,20000", "press home")
        self.assertEqual(self.at(), home)
        self.assertTrue(self.port.nothing_more((b"\x03", b"\r")))
        self.do("set position 1 20000,20000,20000")
        self.e.do("press home")
        self.e.do("advance 150ms")
        self.e.do("press home")
        self.e.do("advance 100ms")
        paused = self.at()
        self.e.do("advance 1h")
        self.assertEqual((self.at(), self.panel("paused", "screen")), (paused, (True, "red")))
        self.do("press home")
        self.assertEqual(self.at(), home)

    # "WORK: Move to defined work position. Press again to pause/resume."
    def test_work(self):
        self.begin()
        self.do("press work")
        self.assertEqual(self.at(), [START] * 3)  # none is stored
        self.do("hold work 3s", "knob x 100", "knob y 100", "knob z 100")
        self.e.do("press work")
        self.e.do("advance 150ms")
        self.e.do("press work")
        self.e.do("advance 100ms")
        paused = self.at()
        self.e.do("advance 1h")
        self.assertEqual(self.at(), paused)
        self.do("press work")
        self.assertEqual(self.at(), [START] * 3)

    # "HOME: X & Z first, Y last. WORK: Y first. X & Z last. At 45, movement is simultaneous; at <45, Z has precedence; at >45, X"
    def test_the_order_of_axes_of_both_buttons_is_the_angles(self):
        self.begin("--work", "0,0,0")
        for degrees, home, work in ((30, ["z", "x", "y"], ["y", "z", "x"]), (45, ["xz", "y", ""], ["y", "xz", ""]),
                                    (60, ["x", "z", "y"], ["y", "x", "z"])):
            self.assertEqual(self.ask(bytes([0x41, degrees]), 1), b"\r")
            for button, order in (("home", home), ("work", work)):
                with self.subTest(degrees=degrees, button=button):
                    self.do("set position 1 5333,5333,5333")  # each axis takes 100 ms
                    self.e.do(f"press {button}")
                    self.e.do("advance 100ms")
                    self.assertEqual(self.places(50, 150, 250), order)
                    self.e.do("advance until idle")

    # "PULSE (ANGLE): Advances diagonal axis in 2.85 um steps."
    def test_pulse(self):
        self.begin()
        self.assertEqual(self.moved_by("press pulse"), [26, 0, 15])  # 2.468 and 1.425 um
        self.assertEqual(self.moved_by("press angle"), [26, 0, 15])

    # "Hold 3-sec. sets ANGLE (active for 10 sec.): Knob D changes angle (1 - 89)."
    def test_angle(self):
        self.begin()
        self.do("hold pulse 3s")
        self.assertEqual(self.panel("setting_angle", "beeps"), (True, 1))
        self.assertEqual(self.moved_by("knob d +5"), [0, 0, 0])
        self.assertEqual(self.panel("angle_deg"), (35,))
        self.do("knob d +1000")
        self.assertEqual(self.ask(b"c", 14)[12], 89)
        self.do("knob d -1000")
        self.assertEqual(self.ask(b"c", 14)[12], 1)
        self.do("knob d +44", "advance 9979999us")  # 20 ms went for the questions
        self.assertEqual(self.panel("setting_angle"), (True,))
        self.do("advance 1us")
        self.assertEqual(self.panel("setting_angle", "angle_deg"), (False, 45))
        self.assertEqual(self.moved_by("knob d +1"), [45, 0, 45])  # 64 along the diagonal: 45.25
        self.assertEqual(self.panel("angle_deg"), (45,))

    # "RELATIVE: Toggles between Relative and Absolute position moves. Hold 3-sec. to set relative mode origin to current absolute"
    def test_relative(self):
        self.begin()
        self.do("hold relative 3s", "press relative", "knob y +10")
        self.assertEqual(self.panel("screen", "relative", "beeps"), ("blue", True, 1))
        self.assertEqual(self.panel("shown_um")[0], {"x": 0, "y": 60, "z": 0, "d": 0})
        self.assertEqual(self.ask(b"c", 14), emu.point(START, START + 640, START) + b"\x1e\r")  # never relative
        self.assertEqual(self.ask(b"x" + emu.point(0, 0, 0)[:4], 1, "300ms"), b"\r")
        self.assertEqual(self.panel("shown_um")[0]["x"], -START * 0.09375)
        self.do("press relative")
        self.assertEqual(self.panel("screen", "relative"), ("green", False))
        self.assertEqual(self.panel("shown_um")[0]["x"], 0)

    # "SPEED (LOCK): Cycles through Speed 0 (normal) through 3."
    def test_speed(self):
        self.begin()
        for speed, steps in ((0, 64), (1, 16), (2, 4), (3, 1), (0, 64)):
            self.assertEqual(self.panel("speed"), (speed,))
            self.assertEqual(self.moved_by("knob z +1"), [0, 0, steps])
            self.do("press speed")

    # "Hold 3 sec. for LOCK mode." "Red = ... in quiet (LOCK) mode; knobs disabled."
    def test_lock(self):
        self.begin()
        self.do("hold speed 3s")
        self.assertEqual(self.panel("screen", "locked", "beeps"), ("red", True, 1))
        for knob in "xyzd":
            self.assertEqual(self.moved_by(f"knob {knob} +10"), [0, 0, 0])
        self.assertEqual(self.ask(b"x" + emu.point(START + 16, 0, 0)[:4], 1), b"\r")
        self.assertEqual(self.at(), [START + 16, START, START])
        self.do("press home")
        self.assertEqual(self.at(), [0, 0, 0])
        self.do("hold lock 3s")
        self.assertEqual(self.panel("screen", "locked", "beeps"), ("green", False, 2))
        self.assertEqual(self.moved_by("knob x +1"), [64, 0, 0])

    # The knobs, and "D-Axis Movement (Synthetic)".
    def test_knobs(self):
        self.begin()
        self.assertEqual(self.moved_by("knob x +2"), [128, 0, 0])
        self.assertEqual(self.moved_by("knob y -2"), [0, -128, 0])
        self.assertEqual(self.moved_by("knob z +2"), [0, 0, 128])
        self.assertEqual(self.moved_by("knob d +100"), [5543, 0, 3200])  # 6,400 at 30 degrees
        self.assertEqual(self.moved_by("knob d -100"), [-5543, 0, -3200])

    # "Movement knobs are disabled during movement to Home, Work, external movement command"; "Red = Movement in progress".
    def test_knobs_during_moves(self):
        self.begin("--work", "20000,20000,20000")
        for move in ("press home", "press work", b"h", b"w", b"H" + emu.point(5000, 5000, 5000), b"W" + emu.point(9000, 9000, 9000),
                     b"S\x00" + emu.point(0, 0, 0), b"x" + emu.point(9000, 0, 0)[:4], b"R"):
            with self.subTest(move=move):
                if isinstance(move, str):
                    self.e.do(move)
                else:
                    self.port.send(move)
                self.e.do("advance 110ms")
                self.assertEqual(self.panel("screen"), ("red",))
                self.assertEqual(self.moved_by("knob x +1", "knob y +1", "knob z +1", "knob d +1"), [0, 0, 0])
                self.e.do("advance until idle")
                if not isinstance(move, str):
                    self.assertEqual(self.port.receive(1), b"\r")
                self.assertEqual(self.panel("screen"), ("green",))

    # [T table 1] switches 1 to 4: OFF clockwise is forward, ON counter.
    def test_external_switches_1_to_4(self):
        self.begin()
        self.do(*(f"switch rear {i} on" for i in (1, 2, 3, 4)))
        self.assertEqual(self.moved_by("knob x +1"), [64, 0, 0])  # not before it is switched on again
        self.do("power off", "power on", "advance until idle")
        self.assertEqual(self.moved_by("knob x +1", "knob y +1", "knob z +1"), [-64, -64, -64])
        self.assertEqual(self.moved_by("knob d +100"), [-5543, 0, -3200])

    # Switch 5, Y axis lock-out for homing: OFF enabled, ON disabled.
    def test_external_switch_5(self):
        self.begin()
        self.do("switch rear 5 off", "switch rear 6 off", "power off", "power on", "press home")
        self.assertEqual(self.at(), [0, START, 0])
        self.assertEqual(self.ask(b"x" + emu.point(100, 0, 0)[:4], 1), b"\r")
        self.assertEqual(self.ask(b"h", 1), b"\r")
        self.assertEqual(self.at(), [0, START, 0])

    # Switch 6, calibration homing on power on: OFF none, ON calibrate; "OFF to retain axis positions on power-off".
    def test_external_switch_6(self):
        self.begin()
        self.do("knob x 10", "power off", "power on")
        self.assertEqual(self.panel("screen"), ("red",))
        self.do("advance until idle")
        self.assertEqual(self.at(), [START] * 3)
        self.do("switch rear 6 off", "knob x 10", "power off", "power on")
        self.assertEqual((self.panel("screen"), self.at()), (("green",), [START + 640, START, START]))

    # [T table 2] 2: MP-x45 OFF, MP-285 ON. 4: linear OFF, non-linear ON. 1 and 3: reserved.
    def test_internal_switches(self):
        for stage, is_on in (("MP-845", False), ("MP-865", False), ("MP-285", True), ("MP-265", True)):
            self.begin("--device", stage)
            self.assertEqual(self.e.do("panel")["switches"]["internal"], [False, is_on, False, False])
        self.begin()
        self.do(*(f"switch internal {i} on" for i in (1, 3, 4)), "power cycle", "advance until idle", "knob x 1", "advance 3ms")
        self.assertEqual(self.moved_by("knob x 1"), [8 * 64, 0, 0])
        self.assertEqual(self.e.do("panel")["switches"]["internal"], [True, False, True, True])


class Roe200(Controls):
    KIND = "mpc"

    # [M page 1] "NORM/DIAG: Normal or Diagonal (LED on) mode."
    def test_diagonal(self):
        self.begin()
        self.assertEqual(self.panel("leds"), ({"diagonal": False},))
        self.do("press diagonal", "knob mode 1")
        self.assertEqual(self.panel("leds"), ({"diagonal": True},))
        self.assertEqual(self.moved_by("knob z +100"), [22391, 0, 12411])  # 25,600 at 28660 : 15886
        self.assertEqual(self.moved_by("knob x +1", "knob y +1"), [256, 256, 0])
        self.do("press diagonal")
        self.assertEqual(self.panel("leds"), ({"diagonal": False},))
        self.assertEqual(self.moved_by("knob z +1"), [0, 0, 256])

    # "STOP/SET: ... Hold down and press WORK sets Work pos. to current pos." "WORK POS: Moves to defined Work Position."
    # "HOME: Moves to position 0,0,0."
    def test_work_and_home(self):
        self.begin("--position", "4800,9600,2400")
        self.e.do("hold stop 500ms")
        self.e.do("advance 50ms")
        self.do("press work")
        self.assertEqual((self.panel("beeps"), self.at()), ((1,), [4800, 9600, 2400]))
        self.e.do("advance 500ms")
        self.do("knob mode 5", "knob x 1", "press work")
        self.assertEqual(self.at(), [4816, 9600, 2400])  # not from here
        self.do("press home")
        self.assertEqual(self.at(), [0, 0, 0])
        self.do("press work")
        self.assertEqual(self.at(), [4800, 9600, 2400])
        self.assertTrue(self.port.nothing_more(emu.ACTIVE))

    # "Hold >2 sec., lock/unlocks ROE."
    def test_lock(self):
        self.begin()
        self.do("hold work 1999999us")
        self.assertEqual(self.panel("locked"), (False,))
        self.do("hold work 2s")
        self.assertEqual(self.panel("locked", "beeps"), (True, 1))
        for line in ("knob x 9", "knob y 9", "knob z 9", "knob mode 3", "press home", "press calibrate", "press diagonal", "press work"):
            self.assertEqual(self.moved_by(line), [0, 0, 0])
        self.assertEqual(self.panel("mode", "leds"), (0, {"diagonal": False}))
        self.assertEqual(self.ask(b"M" + emu.point(48, 0, 0), 1), b"\r")
        self.port.send(b"M" + emu.point(48048, 0, 0))
        self.e.do("advance 500ms")
        self.e.do("press stop")
        self.e.do("advance 200ms")
        self.assertEqual((self.port.receive(1), self.at()), (b"\r", [24048, 0, 0]))
        self.do("hold work 2s")
        self.assertEqual(self.panel("locked", "beeps"), (False, 2))
        self.assertEqual(self.moved_by("knob x 1"), [64, 0, 0])

    # "STOP/SET: Stops movement."
    def test_stop(self):
        for begun in (b"M" + emu.point(48000, 0, 0), b"H", b"N", b"S\x00" + emu.point(0, 0, 0), "press home", "press calibrate"):
            with self.subTest(begun=begun):
                self.begin("--position", "96000,96000,96000")
                if isinstance(begun, str):
                    self.e.do(begun)
                else:
                    self.port.send(begun)
                self.e.do("advance 500ms")
                self.e.do("press stop")
                stopped = self.at()
                self.e.do("advance 10s")
                self.assertEqual((self.at(), self.panel("moving")), (stopped, (None,)))
                self.assertNotIn(stopped, ([0, 0, 0], [96000, 96000, 96000]))
                if not isinstance(begun, str):
                    self.assertEqual(self.port.receive(1), b"\r")
                self.assertTrue(self.port.nothing_more(emu.ACTIVE))

    def test_other_buttons_and_the_knobs_are_dead_during_a_hosts_move(self):
        self.begin()
        self.port.send(b"M" + emu.point(96000, 0, 0))
        self.e.do("advance 100ms")
        for line in ("press home", "press work", "press calibrate", "press diagonal", "knob mode 1", "knob manipulator 1", "knob y 1"):
            self.e.do(line)
            self.e.do("advance 100ms")
        self.e.do("advance until idle")
        self.assertEqual((self.port.receive(1), self.at()), (b"\r", [96000, 0, 0]))
        self.assertEqual(self.panel("device", "mode", "leds"), (1, 0, {"diagonal": False}))

    # "MANIPULATOR: Selects Manipulator 1 through 4 (as connected)."  [M table 1] switch 3: ON not cyclical, OFF cyclical.
    def test_manipulator(self):
        self.begin("--device", "MP-225", "--device", "none", "--device", "MP-285", "--device", "MP-265")
        seen = []
        for _ in range(4):
            self.do("knob manipulator +1")
            seen.append(self.ask(b"K", 4)[0])
        self.do("switch roe 3 on", "power cycle", "knob manipulator +9")
        self.assertEqual(seen + [self.ask(b"K", 4)[0], *self.panel("device")], [3, 4, 1, 3, 4, 4])
        self.do("knob x 1")
        self.assertEqual([self.e.position(i) for i in (1, 4)], [[0, 0, 0], [64, 0, 0]])
        self.do("knob manipulator -9")
        self.assertEqual(self.ask(b"K", 4)[0], 1)

    # "MODE: Selects Mode 0 through 9, or 0 and 5 (ROE Switch 1 OFF)."
    def test_mode(self):
        self.begin()
        for mode in range(1, 10):
            self.do("knob mode +1")
            self.assertEqual(self.panel("mode"), (mode,))
            self.assertEqual(self.moved_by("knob y +1"), [0, 512 >> mode, 0])
        self.do("knob mode +1")
        self.assertEqual(self.panel("mode"), (9,))
        self.assertEqual(self.ask(b"L\x03", 1), b"\r")
        self.assertEqual(self.panel("mode"), (3,))
        self.do("switch roe 1 off", "power cycle")
        seen = []
        for turn in ("+1", "+1", "-1", "-1"):
            self.do("knob mode " + turn)
            seen += self.panel("mode")
        self.assertEqual(seen, [5, 5, 0, 0])

    # "CENTER (CALIBRATE)"; [M table 9] 'N' of firmware up to 1.03: centre of travel.
    def test_calibrate(self):
        self.begin("--position", "4800,4800,4800")
        self.do("press calibrate")
        self.assertEqual(self.at(), [0, 0, 0])
        self.begin("--position", "4800,4800,4800", "--firmware", "1.03")
        self.do("press center")
        self.assertEqual(self.at(), [200000] * 3)

    # "Display: Shows current position along with other state information."
    def test_display(self):
        self.begin("--position", "1600,3200,4800")
        self.assertEqual(self.panel("shown_um", "moving", "locked", "mode", "device"),
                         ({"x": 100, "y": 200, "z": 300}, None, False, 0, 1))
        self.port.send(b"M" + emu.point(49600, 3200, 4800))
        self.e.do("advance 500ms")
        shown, moving = self.panel("shown_um", "moving")
        self.assertEqual((round(shown["x"]), moving), (1600, "move"))

    # [M table 1] switch 2, relative coordinates during diagonal mode: ON enabled, OFF disabled.
    def test_roe_switch_2(self):
        self.begin("--position", "1600,1600,1600")
        self.do("press diagonal")
        self.assertEqual(self.panel("shown_um")[0]["x"], 0)
        self.do("switch roe 2 off", "power cycle", "press diagonal")
        self.assertEqual(self.panel("shown_um")[0]["x"], 100)

    # [M table 2] every position of switches 1 to 4, in the order of the table.
    def test_every_angle_of_switches_1_to_4(self):
        table = ((79, "0000"), (76, "1000"), (69, "0100"), (63, "1100"), (61, "0010"), (55, "1010"), (51, "0110"), (45, "1110"),
                 (39, "0001"), (35, "1001"), (29, "0101"), (27, "1101"), (21, "0011"), (14, "1011"), (11, "0111"), (7, "1111"))
        self.begin()
        for degrees, switches in table:
            self.do(*(f"switch rear {i} {'on' if on == '1' else 'off'}" for i, on in enumerate(switches, 1)), "power cycle")
            self.assertEqual(self.panel("angle_deg"), (degrees,))

    # [M table 3] 5 to 7: ON clockwise is forward, OFF counter-clockwise. 8: OFF Y is not moved by HOME and WORK.
    def test_switches_5_to_8(self):
        self.begin("--position", "1600,1600,1600")
        self.do(*(f"switch rear {i} off" for i in (5, 6, 7, 8)), "power cycle")
        self.assertEqual(self.moved_by("knob x 1", "knob y 1", "knob z 1"), [-64, -64, -64])
        self.do("press home")
        self.assertEqual(self.at(), [0, 1536, 0])
        self.assertEqual(self.ask(b"H", 1), b"\r")
        self.assertEqual(self.at(), [0, 1536, 0])

    # [M table 4] RIGHT TRAN: switch 1 manipulator A, switch 2 manipulator B; table 1, switch 4: reserved.
    def test_right_angle_and_reserved_switches(self):
        self.begin()
        self.assertEqual(self.e.do("panel")["switches"]["right"], [False, False])  # not installed: normal operation
        self.do("switch right 2 on", "switch roe 4 off", "power cycle")
        switches, = self.panel("switches")
        self.assertEqual((switches["right"], switches["roe"][3]), ([False, True], False))
        self.assertEqual(self.moved_by("knob x 1", "knob y 1", "knob z 1"), [64, 64, 64])


del Controls
emu.main()
