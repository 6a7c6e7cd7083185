"""Rig files: several controllers in one process, each with its own port; and what is said about wrong files."""
import json
import os
import subprocess
import sys

import emu
from ctl import ctl
from emu import Port, point

CR = b"\r"
RIGHT = """
controllers = (
    { name = "left"; controller = "mpc"; link = "LINK"; devices = [ "none", "MP-285" ];
      positions = [ "1000um,0um,0um" ]; quirks = "position-13"; },
    { name = "right"; controller = "trio"; angle = "45"; home = "1,2,3"; },
    { controller = "mpc"; firmware = "3.19"; }
);
"""


class Rig(emu.InDirectory):
    def setUp(self):
        super().setUp()
        self.path = os.path.join(self.directory, "rig.cfg")
        self.link = os.path.join(self.directory, "link")

    def write(self, text):
        with open(self.path, "w", encoding="ascii") as file:
            file.write(text.replace("LINK", self.link))

    def test_each_controller_is_what_the_file_says(self):
        self.write(RIGHT)
        process = emu.start("rig", self.path)
        ready = process.stdout.readline().decode().split()
        self.assertEqual(ready[0], "ready")
        paths = dict(word.split("=") for word in ready[1:])
        self.assertEqual(list(paths), ["left", "right", "mpc"])
        self.assertEqual(os.readlink(self.link), paths["left"])
        with Port(paths["left"]) as left, Port(paths["right"]) as right, Port(paths["mpc"]) as other:
            self.assertEqual(left.ask(b"C", 13), point(16000, 0, 0) + CR)
            self.assertEqual(left.ask(b"U", 6), b"\x01\x00\x01\x00\x00" + CR)
            self.assertEqual(right.ask(b"c", 14)[12], 45)
            right.send(b"h")
            self.assertEqual(other.ask(b"K", 4), b"\x01\x19\x03" + CR)
            self.assertEqual(right.receive(1), CR)
            self.assertEqual(right.ask(b"c", 14)[:12], point(1, 2, 3))
        process.terminate()
        process.communicate(timeout=emu.LIMIT_S)
        self.assertEqual(process.returncode, 0)
        self.assertFalse(os.path.lexists(self.link))

    def test_a_plug_and_the_power_of_one_are_its_own(self):
        self.write(RIGHT)
        control = os.path.join(self.directory, "control")
        process = emu.start("rig", self.path, "--clock", "step", "--control", control)
        self.addCleanup(process.kill)
        paths = dict(word.split("=") for word in process.stdout.readline().decode().split()[1:])

        def do(*words):
            status, out, error = ctl(control, *words)
            self.assertEqual((status, error), (0, ""))
            return json.loads(out)

        def told(who, what):
            return do("@" + who, "state")["controllers"][0][what]
        do("@left", "fault", "usb-unplug", "5s", "on", "K")
        do("@right", "fault", "power-loss", "1s")
        with Port(self.link) as left, Port(paths["right"]) as right:
            right.send(b"x" + bytes(4))
            left.send(b"K")
            do("advance", "1s")
            self.assertEqual((told("left", "port"), told("right", "state"), told("mpc", "state")), (None, "off", "rest"))
            self.assertFalse(os.path.lexists(self.link))
        self.assertTrue(do("advance", "until", "idle")["idle"])
        self.assertEqual((os.readlink(self.link), told("right", "state")), (told("left", "port"), "rest"))
        process.terminate()
        process.communicate(timeout=emu.LIMIT_S)

    def test_run_gives_each_port_a_variable(self):
        self.write(RIGHT)
        script = "import os; print(sorted(k for k in os.environ if k.startswith('DRYRIG_PORT'))); print(os.environ['DRYRIG_PORT_left'])"
        done = subprocess.run([emu.PROGRAM, "run", "--rig", self.path, "--", sys.executable, "-c", script],
                              capture_output=True, check=False, timeout=emu.LIMIT_S)
        self.assertEqual(done.returncode, 0, done)
        names, left = done.stdout.decode().splitlines()
        self.assertEqual(names, "['DRYRIG_PORT_left', 'DRYRIG_PORT_mpc', 'DRYRIG_PORT_right']")
        self.assertEqual(left, self.link)

    def test_check(self):
        self.write(RIGHT)
        self.assertEqual(emu.outcome("rig", "check", self.path), (0, f"{self.path}: 3 controllers, nothing wrong\n", ""))

    def refused(self, text, line, column, *words):
        self.write(text)
        status, out, error = emu.outcome("rig", "check", self.path)
        self.assertEqual((status, out), (2, ""), error)
        self.assertIn(f"{self.path}:{line}:{column}: ", error)
        for word in words:
            self.assertIn(word, error)

    def test_errors_have_line_and_column(self):
        self.refused("controllers = (\n  { controller = \"mpc\"; devices = [ \"MP-225\",\n      \"MP-999\" ]; }\n);", 3, 7 + 1, "MP-999", "MP-845")
        self.refused("controllers = (\n  { controler = \"mpc\"; }\n);", 2, 5, "controler", "controller")
        self.refused("controllers = (\n  { controller = \"mpc\" \n    name = [1; }\n);", 3, 5, "")
        self.refused("controllers = ( { name = \"a\"; } );", 1, 1, "controller =")
        self.refused("controllers = (\n  { controller = \"mpc\"; },\n  { controller = \"mpc\"; }\n);", 3, 19, "already")
        self.refused("controllers = (\n  { controller = \"trio\"; angle = \"91\"; }\n);", 2, 35, "91", "90")
        self.refused("controllers = (\n  { controller = \"trio\"; angle = 91; }\n);", 2, 26, "quotation")
        self.refused("controllers = (\n  { controller = \"mpc\"; name = \"a b\"; }\n);", 2, 33, "a b", "letters")
        self.refused("", 1, 1, "controllers = (")
        self.refused("speed = 1;\n", 1, 1, "speed")
        self.refused("controllers = ( );", 1, 1, "list")

    def test_values_are_found_where_they_stand(self):
        """And not within the words before them."""
        one = "  {{ name = \"{}\"; controller = \"mpc\"; }}"
        self.refused("controllers = (\n" + one.format("a") + ",\n" + one.format("a") + "\n);", 3, 13, "'a'", "already")
        self.refused("controllers = (\n  { controller = \"mpc\";\n    name = \"1\"; }\n);", 3, 13, "'1'", "letters")
        self.refused("controllers = (\n  { controller = \"trio\"; angle = \"t\"; }\n);", 2, 35, "angle t", "90")
        self.refused("controllers = (\n  { controller = \"mpc\"; do = [ \"d\" ]; }\n);", 2, 33, "'d' is no verb")

    def test_two_that_would_share_a_file(self):
        for key in "link", "state":
            path = os.path.join(self.directory, "shared")
            self.refused(f"controllers = (\n  {{ name = \"l\"; controller = \"mpc\"; {key} = \"{path}\"; }},\n"
                         f"  {{ name = \"r\"; controller = \"mpc\";\n    {key} = \"{path}\"; }}\n);", 4, len(key) + 9,
                         key, path, "'l' has it already")

    def test_a_file_that_is_not_there(self):
        status, _, error = emu.outcome("rig", "check", self.path)
        self.assertEqual(status, 2)
        self.assertIn(self.path, error)

    def test_options_of_one_controller_have_no_meaning(self):
        self.write(RIGHT)
        status, _, error = emu.outcome("rig", self.path, "--device", "MP-285")
        self.assertEqual(status, 2)
        self.assertIn("rig file", error)


if __name__ == "__main__":
    emu.main()
