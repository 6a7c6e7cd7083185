"""Hands by the control channel of a running emulator, its clock moved by the test: buttons, knobs, switches, the display.

Numbers are from PROTOCOL.md, "Hand controls": an MP-845 of a TRIO has 0.09375 um a microstep and stands at 10,667 at first;
SPEED 0 is 64 microsteps a detent; an MP-225 of an MPC-200 has 0.0625 um a microstep and mode 5 is 16 of them."""
import unittest

import emu
from ctl import Rehearsal


def trio(*args):
    return Rehearsal("trio", "--clock", "step", *args)


def mpc(*args):
    return Rehearsal("mpc", "--clock", "step", *args)


def lines(e):
    return e.do("panel")["text"].split("\n")


class Buttons(unittest.TestCase):
    def test_a_press_goes_down_at_once_and_up_after_100_ms_of_the_controllers_time(self):
        with trio() as e:
            e.do("press home")
            self.assertEqual(e.do("panel")["down"], ["home"])
            e.do("advance 99999us")
            self.assertEqual(e.do("panel")["down"], ["home"])
            self.assertEqual(e.controller()["state"], "rest")
            e.do("advance 1us")
            self.assertEqual(e.do("panel")["down"], [])
            self.assertEqual(e.controller()["move"], "home")
            self.assertEqual(e.do("advance until idle")["now_us"], 100000 + 3 * 200007)  # Z, X, Y: 1,000 um at 5,000 um/s
            self.assertEqual(e.position(), [0, 0, 0])

    def test_a_hold_acts_at_3_s_to_the_microsecond(self):
        with trio() as e:
            e.do("hold work 3s")
            e.do("advance 2999999us")
            self.assertIsNone(e.controller()["devices"][0]["work_steps"])
            e.do("advance 1us")
            self.assertEqual(e.controller()["devices"][0]["work_steps"], [10667] * 3)
            self.assertEqual(e.do("panel")["beeps"], 1)
            self.assertEqual(e.do("panel")["down"], [])

    def test_a_hold_one_microsecond_short_is_a_press(self):
        with trio("--work", "0,0,0") as e:
            e.do("hold work 2999999us")
            e.do("advance 2999999us")
            self.assertEqual(e.controller()["move"], "work")
            self.assertEqual(e.controller()["devices"][0]["work_steps"], [0, 0, 0])

    def test_what_a_button_does_can_come_with_time(self):
        with trio() as e:
            e.do("at 1s press relative")
            e.do("in 2s knob x +10")
            e.do("advance 3s")
            self.assertTrue(e.do("panel")["relative"])
            self.assertEqual(e.position(), [10667 + 640, 10667, 10667])

    def test_home_pauses_a_hosts_h_and_the_cr_comes_when_it_ends(self):
        with trio() as e, emu.Port(e.path) as port:
            port.send(b"h")
            e.do("advance 100ms")
            e.do("press home")
            e.do("advance 10s")
            self.assertEqual(e.do("panel")["paused"], True)
            self.assertIn("PAUSED", lines(e)[3])
            self.assertEqual(port.waiting(), 0)
            e.do("press home")
            e.do("advance until idle")
            self.assertEqual(port.receive(1), b"\r")
            self.assertEqual(e.position(), [0, 0, 0])

    def test_stop_ends_a_hosts_move_with_its_one_cr(self):
        for quirk, answer in ((None, b"\r"), ("stop-says-i", b"I")):
            with mpc(*(["--quirks", quirk] if quirk else [])) as e, emu.Port(e.path) as port:
                port.send(b"M" + emu.point(48000, 0, 0))  # 3,000 um at 3,000 um/s
                e.do("advance 500ms")
                e.do("press stop")
                e.do("advance until idle")
                self.assertEqual(port.receive(1), answer)
                self.assertEqual(e.position(), [24000, 0, 0])
                self.assertTrue(port.nothing_more(emu.ACTIVE))

    def test_stop_held_with_work_stores(self):
        with mpc("--position", "100,200,300") as e:
            e.do("hold stop 1s")
            e.do("press work")
            e.do("advance 1s")
            self.assertEqual(e.controller()["devices"][0]["work_steps"], [100, 200, 300])

    def test_a_button_is_let_go_before_its_time(self):
        with trio() as e:
            e.do("hold home 1000h")
            e.do("advance 2s")
            self.assertIn("'release home' lets it go", e.refuses("press home"))
            e.do("release home")  # before 3 s: a press
            self.assertEqual((e.do("panel")["down"], e.controller()["move"]), ([], "home"))
            self.assertIn("'home' is not down", e.refuses("release home"))
            e.do("advance until idle")
            self.assertEqual(e.position(), [0, 0, 0])
            e.do("hold work 1000h")
            e.do("hold speed 1000h")
            e.do("advance 3s")
            e.do("release work")
            self.assertEqual(e.do("panel")["down"], ["speed"])  # each by itself
            e.do("release lock")
            panel = e.do("panel")
            self.assertEqual((panel["down"], panel["locked"], panel["beeps"]), ([], True, 2))
            e.do("hold lock 1s")
            e.do("in 999999us release speed")  # and its own end finds nothing any more
            e.do("advance 2s")
            self.assertEqual((e.do("panel")["speed"], e.do("panel")["down"]), (1, []))
            e.do("press pulse")  # may be down when the emulator ends

    def test_how_long_a_button_can_be_held(self):
        with trio() as e:
            for span in "1000h", "3600000s", "60000min", "1us":
                e.do("hold home " + span)
                e.do("release home")
                e.do("advance until idle")
            for span in "1001h", "3600001s", "1000.5h":
                self.assertIn("1000h at most", e.refuses("hold home " + span))
            self.assertEqual(e.do("panel")["down"], [])

    def test_every_button_has_its_names(self):
        for start, names in ((trio, "home work pulse angle relative speed lock"),
                             (mpc, "home work stop set diagonal norm diag calibrate center")):
            with start() as e:
                for name in names.split():
                    e.do("press " + name)
                    e.do("advance until idle")

    def test_what_is_refused(self):
        with trio() as e:
            self.assertIn("expected one of home, work, pulse, relative, speed", e.refuses("press stop"))
            self.assertIn("time with its unit", e.refuses("hold work"))
            self.assertIn("time with its unit", e.refuses("hold work 3"))
            self.assertIn("one word too many", e.refuses("press home twice"))
            e.do("press home")
            self.assertIn("down already", e.refuses("press home"))
            self.assertIn("down already", e.refuses("hold home 3s"))
            self.assertIn("'work' is not down", e.refuses("release work"))
            self.assertIn("expected one of home, work, pulse", e.refuses("release stop"))
            self.assertIn("one word too many", e.refuses("release home now"))
            self.assertIn("expected one of x, y, z, d", e.refuses("knob q 1"))
            self.assertIn("x, y, z, d; it is pressed: press home", e.refuses("knob home 1"))
            self.assertIn("angle, lock; it is turned: knob x +1", e.refuses("hold x 1s"))
            self.assertNotIn("it is", e.refuses("press manipulator"))  # it has none
            self.assertIn("whole number", e.refuses("knob x"))
            self.assertIn("whole number", e.refuses("knob x 1.5"))
            self.assertIn("from 1 to 6", e.refuses("switch rear 7 on"))
            self.assertIn("on or off", e.refuses("switch rear 6"))
            self.assertIn("follows the device", e.refuses("switch internal 2 on"))
            self.assertIn("expected one of rear, internal", e.refuses("switch roe 1 on"))
            self.assertIn("one word too many", e.refuses("panel now"))

    def test_a_button_may_be_down_when_the_emulator_ends(self):
        with trio() as e:
            e.do("hold work 3s")


class Knobs(unittest.TestCase):
    def test_a_knob_moves_its_axis_and_the_next_answer_tells(self):
        with trio() as e, emu.Port(e.path) as port:
            e.do("knob x +120")
            e.do("knob y -1")
            e.do("knob z 2")
            port.send(b"c")
            e.do("advance 10ms")
            self.assertEqual(port.receive(14), emu.point(10667 + 120 * 64, 10667 - 64, 10667 + 128) + b"\x1e\r")

    def test_knobs_are_dead_during_a_move(self):
        with trio() as e:
            e.do("press home")
            e.do("advance 200ms")
            e.do("knob y +1")
            e.do("advance until idle")
            self.assertEqual(e.position(), [0, 0, 0])

    def test_angle_set_by_knob_orders_the_hosts_next_move(self):
        with trio() as e, emu.Port(e.path) as port:
            e.do("hold angle 3s")
            e.do("advance 3s")
            e.do("knob d +15")
            self.assertEqual(e.do("panel")["angle_deg"], 45)
            port.send(b"H" + emu.point(0, 10667, 0))
            e.do("advance until idle")
            self.assertEqual(port.receive(1), b"\r")
            now = e.do("state")["now_us"]
            self.assertEqual(now, 3000000 + 10000000)  # the angle setting ends after the move

    def test_manipulator_changes_k_and_mode_is_kept_by_each_device(self):
        with mpc() as e, emu.Port(e.path) as port:
            e.do("knob mode +5")
            e.do("knob manipulator +1")
            port.send(b"K")
            e.do("advance 10ms")
            self.assertEqual(port.receive(4), b"\x02\x21\x03\r")
            panel = e.do("panel")
            self.assertEqual((panel["device"], panel["mode"]), (2, 0))
            e.do("knob manipulator +1")  # cyclical
            panel = e.do("panel")
            self.assertEqual((panel["device"], panel["mode"]), (1, 5))
            e.do("knob x 3")
            self.assertEqual(e.position(), [48, 0, 0])
            self.assertEqual(e.position(2), [0, 0, 0])


class Switches(unittest.TestCase):
    def test_a_switch_counts_from_the_next_power_up_on(self):
        with trio() as e:
            e.do("switch rear 1 on")
            self.assertEqual(e.do("panel")["switches"]["rear"], [True, False, False, False, True, True])
            e.do("knob x 1")
            self.assertEqual(e.position()[0], 10667 + 64)
            e.do("switch rear 6 off")  # no calibration
            e.do("power cycle")
            e.do("advance until idle")
            e.do("knob x 1")
            self.assertEqual(e.position()[0], 10667)

    def test_those_of_an_mpc_belong_to_the_active_device_or_to_the_one_that_is_named(self):
        with mpc() as e:
            e.do("switch rear 5 off")
            e.do("switch rear device 2 6 off")
            e.do("switch right 2 on")  # device B of the MPC-200 that the active one is at
            e.do("switch right device 3 1 on")  # device A of the second
            e.do("switch roe 1 off")
            self.assertEqual(e.do("panel")["switches"],
                             {"rear": [False, True, False, True, False, True, True, True],
                              "roe": [False, True, False, True], "right": [False, True]})
            e.do("power cycle")
            e.do("knob x 1")
            e.do("knob mode 1")
            self.assertEqual(e.do("panel")["mode"], 5)
            e.do("knob manipulator +1")
            self.assertEqual(e.do("panel")["switches"]["rear"], [False, True, False, True, True, False, True, True])
            self.assertEqual(e.do("panel")["switches"]["right"], [False, True])  # it is at the same one
            self.assertIn("from 1 to 4", e.refuses("switch rear device 5 1 on"))
            self.assertIn("from 1 to 2", e.refuses("switch right 3 on"))

    def test_devices_3_and_4_are_at_the_second_mpc_200(self):
        with mpc("--device", "none", "--device", "none", "--device", "MP-225", "--device", "MP-225") as e:
            e.do("switch right device 1 2 on")
            e.do("switch right 1 on")
            self.assertEqual(e.do("panel")["switches"]["right"], [True, False])
            e.do("device 3 unplug")
            e.do("device 4 unplug")
            e.do("device 1 plug MP-225")
            e.do("power cycle")
            self.assertEqual(e.do("panel")["switches"]["right"], [False, True])

    def test_the_diagonal_that_is_set_outlives_a_power_cycle(self):
        with mpc() as e:
            e.do("set angle 45")
            self.assertEqual(e.do("panel")["switches"]["rear"][:4], [True, True, True, False])
            e.do("power cycle")
            self.assertEqual(e.do("panel")["angle_deg"], 45)


class Display(unittest.TestCase):
    def test_a_trio_at_rest_relative_locked_and_moving(self):
        with trio() as e:
            panel = e.do("panel")
            self.assertEqual(panel["screen"], "green")
            self.assertEqual(panel["text"].split("\n"),
                             ["X   1000.03  ABSOLUTE", "Y   1000.03  ANGLE 30", "Z   1000.03  SPEED 0", "D   1366.06"])
            self.assertEqual(panel["shown_um"], {"x": 1000.03125, "y": 1000.03125, "z": 1000.03125, "d": 1366.0625})
            e.do("hold relative 3s")
            e.do("advance 3s")
            e.do("press relative")
            e.do("press speed")
            e.do("advance 100ms")
            e.do("knob x -10")
            panel = e.do("panel")
            self.assertEqual((panel["screen"], panel["speed"]), ("blue", 1))
            self.assertEqual(panel["text"].split("\n")[0], "X    -15.00  RELATIVE")  # 10 x 16 x 0.09375
            e.do("hold lock 3s")
            e.do("advance 3s")
            panel = e.do("panel")
            self.assertEqual((panel["screen"], panel["locked"]), ("red", True))
            self.assertTrue(panel["text"].endswith("LOCK"))
            e.do("press home")
            e.do("advance 200ms")
            panel = e.do("panel")
            self.assertEqual((panel["screen"], panel["moving"]), ("red", "home"))
            self.assertTrue(panel["text"].endswith("HOME"))

    def test_setting_the_angle(self):
        with trio() as e:
            e.do("hold pulse 3s")
            e.do("advance 3s")
            self.assertTrue(e.do("panel")["setting_angle"])
            self.assertTrue(lines(e)[3].endswith("SET ANGLE"))
            e.do("advance 10s")
            self.assertFalse(e.do("panel")["setting_angle"])

    def test_an_mpc_at_rest_and_in_diagonal_mode(self):
        with mpc("--position", "16000,0,0") as e:
            panel = e.do("panel")
            self.assertEqual((panel["screen"], panel["leds"]), ("plain", {"diagonal": False}))
            self.assertEqual(panel["text"].split("\n")[:3],
                             ["X   1000.00  DRIVE 1", "Y      0.00  MODE 0", "Z      0.00  NORM"])
            e.do("press diagonal")
            panel = e.do("panel")
            self.assertEqual(panel["leds"], {"diagonal": True})
            self.assertEqual(panel["text"].split("\n"),
                             ["X      0.00  DRIVE 1", "Y      0.00  MODE 0", "Z      0.00  DIAG 29", "D      0.00"])

    def test_dark_and_empty(self):
        with mpc("--device", "none") as e:
            self.assertEqual(lines(e), ["NO MANIPULATOR", "CONNECTED"])
            e.do("power off")
            panel = e.do("panel")
            self.assertEqual((panel["screen"], panel["text"]), ("dark", ""))


emu.main()
