"""Scenario files: what happens when, and what is said about a file that is wrong, before anything starts."""
import os
import subprocess
import sys

import emu
from ctl import Rehearsal
from emu import Port, point

CR = b"\r"
STEP = ("--clock", "step")


class Files(emu.InDirectory):
    def setUp(self):
        super().setUp()
        self.path = os.path.join(self.directory, "scenario")

    def write(self, text, path=None):
        with open(path or self.path, "w", encoding="utf-8") as file:
            file.write(text)
        return path or self.path


class Scenario(Files):
    def test_lines_are_done_at_the_start_at_a_time_and_after_commands(self):
        self.write("# where it stands\n"
                   "set position 16,0,0   # one um\n"
                   "\n"
                   "   \t # nothing\n"
                   "at 2s set position 32,0,0\r\n"
                   "after 3 commands set position 48,0,0\n"
                   "on C fault drop-cr on K")  # without an end of line
        with Rehearsal("mpc", *STEP, "--scenario", self.path, "--do", "set position 2 64,0,0") as e, Port(e.path) as port:
            self.assertEqual((e.position(), e.position(2)), ([16, 0, 0], [64, 0, 0]))
            e.do("advance 1999999us")
            self.assertEqual(e.position(), [16, 0, 0])
            e.do("advance 1us")
            self.assertEqual(e.position(), [32, 0, 0])
            self.assertEqual(port.ask(b"C", 14)[1:5], b"\x20\0\0\0")
            self.assertEqual(port.ask(b"K", 3), emu.ACTIVE[1][:3])
            self.assertEqual(port.ask(b"C", 14)[1:5], b"\x20\0\0\0")
            self.assertEqual(e.position(), [48, 0, 0])

    def test_run(self):
        self.write("fault drop-cr on K next 2\n")
        script = ("import os\nfd = os.open(os.environ['DRYRIG_PORT'], os.O_RDWR | os.O_NOCTTY)\n"
                  "os.write(fd, b'K')\ngot = os.read(fd, 9)\nos.write(fd, b'C')\n"
                  "while len(got) < 17: got += os.read(fd, 17 - len(got))\nprint(got.hex())")
        done = subprocess.run([emu.PROGRAM, "run", "mpc", "--lint=off", "--scenario", self.path, "--", sys.executable, "-c", script],
                              capture_output=True, check=False, timeout=emu.LIMIT_S)
        self.assertEqual((done.returncode, done.stderr), (0, b""))
        self.assertEqual(bytes.fromhex(done.stdout.decode()), emu.ACTIVE[1][:3] + b"\x01" + point(0, 0, 0) + CR)

    def test_what_cannot_be_known_before_is_told_with_its_place(self):
        self.write("power off\n\n  power off\n")
        status, out, error = emu.outcome("mpc", "--scenario", self.path)
        self.assertEqual((status, out), (2, ""))
        self.assertIn(f"{self.path}:3:3: it is off", error)

    def test_what_is_right_at_its_time_is_not_refused_before(self):
        self.write("at 3s power on\nat 2s power off\nat 1s device 1 unplug\nat 2s device 1 plug\nat 4s set position 3 1,1,1\n"
                   "set position 2 266667,0,0\n")
        with Rehearsal("mpc", *STEP, "--device", "MP-225", "--device", "MP-845", "--scenario", self.path) as e:
            e.do("advance 3500ms")
            self.assertEqual(e.controller()["state"], "rest")
            self.assertEqual(e.controller()["devices"][0]["model"], "MP-225")
        self.assertNotIn("1s device", e.err)


class Wrong(Files):
    def refused(self, line, column, *words, kind="mpc", before="\n# two\n"):
        self.write(before + line + "\n")
        trace = os.path.join(self.directory, "trace")
        status, out, error = emu.outcome(kind, "--scenario", self.path, "--trace", trace, "--link", self.directory + "/link")
        self.assertEqual((status, out), (2, ""), error)
        self.assertIn(f"{self.path}:3:{column}: ", error)
        for word in words:
            self.assertIn(word, error)
        self.assertEqual(os.listdir(self.directory), ["scenario"])  # nothing has started

    def test_each_kind_of_line(self):
        self.refused("dance", 1, "'dance' is no verb")
        self.refused("  dance # with me", 3, "'dance' is no verb")
        self.refused("at", 3, "expected a time")
        self.refused("at 2 power off", 4, "'2'", "unit")
        self.refused("at 2s", 6, "and then?")
        self.refused("at 2s dance", 7, "'dance' is no verb")
        self.refused("at 2s power up", 13, "off, on or cycle")
        self.refused("at 2s on K at 1s power of", 24, "off, on or cycle")
        self.refused("after three commands power off", 7, "'three'", "1000000")
        self.refused("after 3 power off", 9, "after 3 commands")
        self.refused("on Q power off", 4, "'Q'", "active")
        self.refused("power off now", 11, "'now' is one word too many")
        self.refused("fault drop-dead", 7, "'drop-dead'", "drop-cr")
        self.refused("fault drop-cr sometimes", 15, "'sometimes'", "chance")
        self.refused("fault stall-axis w", 18, "x, y or z")
        self.refused("fault stall-axis x on C", 23, "moves")
        self.refused("set position 1,2", 14, "X,Y,Z")
        self.refused("set position 1 1,2,400001", 16, "travel")
        self.refused("set position 5 1,2,3", 14, "1 to 4")
        self.refused("set speed 5", 5, "expected position, work")
        self.refused("set home 0,0,0", 10, "0,0,0")
        self.refused("set mode 4", 10, "TRIO", kind="trio")
        self.refused("quirk tired on", 7, "'tired'", "small-move-silent")
        self.refused("quirk position-13 perhaps", 19, "on or off")
        self.refused("device 3 plug MP-999", 15, "'MP-999'", "MP-225")
        self.refused("usb unplug soon", 12, "'soon'", "unit")
        self.refused("press pulse", 7, "'pulse'", "home")
        self.refused("knob x much", 8, "'much'")
        self.refused("switch rear 9 on", 13, "1 to 8")
        self.refused("advance 2s", 11, "--clock")
        self.refused("@other power off", 1, "no controller 'other'")
        self.refused("subscribe me", 11, "too many")
        self.refused("fault drop-cr from 1s until 0.5s", 29, "'0.5s'", "can never strike")
        self.refused("fault drop-cr until 1s from 1s on K", 29, "'1s'", "can never strike")
        self.refused("power d\u00e9j\u00e0", 8, "byte C3", "ASCII")
        self.refused("set position " + "1" * 600, 512, "longer than 511")

    def test_a_word_that_is_missing(self):
        """What was expected there is told, behind the end of the line, and no empty word is quoted."""
        expected = {"at": "a time", "in": "a time", "after": "a whole number", "on": "a command", "on each": "a command",
                    "fault": "off, drop-byte", "fault stall-axis": "an axis", "fault drop-cr on": "a command",
                    "fault drop-cr chance": "a probability", "fault drop-cr from": "a time", "press": "one of home",
                    "hold home": "a time", "knob": "one of x", "knob x": "a whole number of detents", "switch": "one of rear",
                    "switch rear": "a whole number", "device": "the port", "set position": "X,Y,Z", "set work": "X,Y,Z",
                    "set angle": "7, 11", "set mode": "a whole number", "quirk": "", "advance": "a time", "power": "off",
                    "usb": "plug", "set": "position", "trace": "on"}
        for line, words in expected.items():
            self.refused(line, len(line) + 1, f": expected {words}")
            self.assertNotIn("''", emu.outcome("mpc", "--scenario", self.path)[2])

    def test_knobs_turn_back_too(self):
        for word in ("-30001", "30001", "+", "-", "--5", "x"):
            self.refused(f"knob x {word}", 8, f"'{word}': expected a whole number of detents from -30000 to 30000")
        self.write("knob x -30000\nknob x +30000\nknob y 1")
        with Rehearsal("mpc", *STEP, "--scenario", self.path):
            pass

    def test_a_file_that_is_none(self):
        for make, words in ((lambda: None, "No such file"), (lambda: os.mkdir(self.path), "directory")):
            make()
            status, _, error = emu.outcome("mpc", "--scenario", self.path)
            self.assertEqual(status, 2)
            self.assertIn(f"{self.path}: ", error)
            self.assertIn(words, error)
        os.rmdir(self.path)
        self.write("power off\n\0\n")
        status, _, error = emu.outcome("mpc", "--scenario", self.path)
        self.assertEqual(status, 2)
        self.assertIn("byte 0", error)

    def test_lines_that_wait_are_checked_when_they_are_given(self):
        with Rehearsal("mpc") as e:
            self.assertIn("no verb", e.refuses("at 2s dance"))
            self.assertIn("expected", e.refuses("on K power up"))
            self.assertEqual(e.refuses("at 2s power up").count("("), 1)  # one usage
        status, _, error = emu.outcome("mpc", "--do", "at 2s dance")
        self.assertEqual(status, 2)
        self.assertIn("'dance' is no verb", error)


class Rig(Files):
    RIG = """controllers = (
        {{ name = "left"; controller = "mpc"; scenario = "{0}"; }},
        {{ name = "right"; controller = "trio"; {1} }} );
    """

    def rig(self, more=""):
        return self.write(self.RIG.format(self.path, more), os.path.join(self.directory, "rig.cfg"))

    def test_a_rig_has_a_scenario_for_each_controller_and_one_for_all(self):
        self.write("set position 16,0,0\n@right set position 7,8,9\non K @right set position 8,8,8\n")
        both = self.write("@left set position 2 32,0,0\n", os.path.join(self.directory, "both"))
        process = emu.start("rig", self.rig(), "--clock", "step", "--scenario", both)
        paths = dict(word.split("=") for word in process.stdout.readline().decode().split()[1:])
        with Port(paths["left"]) as left, Port(paths["right"]) as right:
            self.assertEqual(left.ask(b"C", 14), b"\x01" + point(16, 0, 0) + CR)
            self.assertEqual(right.ask(b"c", 14)[:12], point(7, 8, 9))
            self.assertEqual(left.ask(b"\x49\x02", 2), b"\x02\r")
            self.assertEqual(left.ask(b"C", 14), b"\x02" + point(32, 0, 0) + CR)
            self.assertEqual(left.ask(b"K", 4), b"\x02\x21\x03\r")
            self.assertEqual(right.ask(b"c", 14)[:12], point(8, 8, 8))
        process.terminate()
        process.communicate(timeout=emu.LIMIT_S)
        self.assertEqual(process.returncode, 0)

    def test_check_reads_scenarios_and_do_lines_too(self):
        self.write("power of\n")
        self.assertEqual(emu.outcome("rig", "check", self.rig())[0], 2)
        self.assertIn(f"{self.path}:1:7: ", emu.outcome("rig", "check", self.rig())[2])
        self.write("power off\n")
        self.assertEqual(emu.outcome("rig", "check", self.rig())[0], 0)
        status, _, error = emu.outcome("rig", "check", self.rig('do = [ "set mode 3" ];'))
        self.assertEqual(status, 2)
        self.assertIn("rig.cfg:3:", error)
        self.assertIn("a TRIO has no modes", error)
        rig = self.write('controllers = (\n { controller = "mpc"; do = [ "power off",\n   "set position 1 1,2" ]; } );',
                         os.path.join(self.directory, "rig2"))
        self.assertIn(f"{rig}:3:20: '1,2': expected X,Y,Z", emu.outcome("rig", "check", rig)[2])
        status, _, error = emu.outcome("rig", self.rig(), "--scenario", self.write("power off\n", self.path + "2"))
        self.assertEqual(status, 2)
        self.assertIn(":1:1: which controller?", error)


if __name__ == "__main__":
    emu.main()
