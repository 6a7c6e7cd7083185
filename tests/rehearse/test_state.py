"""--state: what a controller keeps while its emulator does not run, and what a kill at any instant leaves of it."""
import os
import random
import stat
import subprocess
import sys
import time

import emu
from ctl import Rehearsal, ctl
from emu import Port, point

CR = b"\r"
STEP = ("--clock", "step")


class Files(emu.InDirectory):
    def setUp(self):
        super().setUp()
        self.path = os.path.join(self.directory, "state")

    def text(self):
        with open(self.path, encoding="ascii") as file:
            return file.read()

    def write(self, text):
        with open(self.path, "w", encoding="ascii") as file:
            file.write(text)

    def start(self, *args, kind="mpc", clock=STEP):
        return Rehearsal(kind, *clock, "--state", self.path, *args)


def state_of(e):
    controller = e.controller()
    return {key: controller[key] for key in controller
            if key in ("angle_deg", "home_steps", "devices")} | {"switches": e.do("panel")["switches"]}


class Kept(Files):
    def test_an_mpc_is_found_as_it_was_left(self):
        with self.start("--device", "MP-225", "--device", "none", "--device", "MP-285") as e, Port(e.path) as port:
            port.send(b"M" + point(4800, 320, 16))
            e.do("advance until idle")
            self.assertEqual(port.receive(1), CR)
            e.do("set position 3 1,2,3")
            e.do("set work 3 4,5,6")
            e.do("switch rear 8 off")
            e.do("switch rear device 3 2 on")
            e.do("switch right device 3 1 on")
            e.do("switch roe 2 off")
            e.do("device 4 plug MP-845")
            e.do("set angle 45")
            e.do("power cycle")
            before = state_of(e)
        self.assertEqual(before["devices"][0]["position_steps"], [4800, 320, 16])
        with self.start() as e, Port(e.path) as port:
            self.assertEqual(state_of(e), before)
            self.assertEqual(port.ask(b"C", 14), b"\x01" + point(4800, 320, 16) + CR)
            port.send(b"H")  # switch 8 is off: Y stays
            e.do("advance until idle")
            self.assertEqual(port.receive(1), CR)
            self.assertEqual(e.position(), [0, 320, 0])

    def test_a_trio_is_found_as_it_was_left(self):
        with self.start(kind="trio") as e, Port(e.path) as port:
            e.do("set position 10000,20000,30000")
            e.do("set home 7,8,9")
            e.do("set work 1,2,3")
            e.do("switch rear 6 off")
            e.do("switch internal 4 on")
            self.assertEqual(port.ask(b"A\x2d", 1), CR)
            before = state_of(e)
        self.assertEqual((before["angle_deg"], before["home_steps"]), (45, [7, 8, 9]))
        with self.start(kind="trio") as e, Port(e.path) as port:
            self.assertEqual(state_of(e), before)
            self.assertEqual(port.ask(b"c", 14), point(10000, 20000, 30000) + b"\x2d" + CR)
            e.do("power cycle")  # switch 6 is off: it does not calibrate
            self.assertEqual(port.ask(b"c", 14), point(10000, 20000, 30000) + b"\x2d" + CR)

    def test_the_power_takes_with_it_what_it_takes_from_a_real_one(self):
        with self.start() as e, Port(e.path) as port:
            port.ask(b"O", 1)
            e.do("set mode 5")
            e.do("power cycle forget")
        with self.start() as e:
            device = e.controller()["devices"][0]
            self.assertEqual((device["mode"], device["calibration"]), (0, "uncalibrated, power-cycled"))
            self.assertFalse(e.controller()["streaming"])

    def test_what_is_said_counts_more_than_what_was_kept(self):
        with self.start("--position", "1,2,3", "--work", "4,5,6") as e:
            e.do("set position 2 7,8,9")
        with self.start("--position", "11,12,13", "--angle", "45") as e:
            devices = e.controller()["devices"]
            self.assertEqual([d["position_steps"] for d in devices[:2]], [[11, 12, 13], [7, 8, 9]])
            self.assertEqual((devices[0]["work_steps"], devices[0]["diagonal"]), ([4, 5, 6], 7))
        with self.start() as e:
            self.assertEqual((e.position(), e.controller()["devices"][0]["diagonal"]), ([11, 12, 13], 7))

    def test_an_orderly_end_in_a_move_keeps_where_it_ends_and_a_kill_where_it_began(self):
        with self.start() as e, Port(e.path) as port:
            port.send(b"M" + point(48000, 0, 0))
            e.do("advance 500ms")
        socket = os.path.join(self.directory, "control")
        process = emu.start("mpc", *STEP, "--state", self.path, "--control", socket)
        with Port(process.stdout.readline().decode().split()[1]) as port:
            port.send(b"M" + point(0, 0, 0))
            self.assertEqual(ctl(socket, "advance", "100ms")[0], 0)
            self.assertIn('"position_steps":[19200,0,0]', ctl(socket, "state")[1])
        process.kill()
        process.communicate()
        with self.start() as e:
            self.assertEqual(e.position(), [24000, 0, 0])

    def test_it_is_written_when_something_has_changed_and_not_else(self):
        with self.start(clock=()) as e, Port(e.path) as port:
            def number():
                return os.stat(self.path).st_ino, os.stat(self.path).st_mtime_ns
            first = number()
            for _ in range(5):
                port.ask(b"C", 14)
                e.do("state")
            self.assertEqual(number(), first)
            e.do("set work 1,2,3")
            emu.wait_until(lambda: number() != first, "written")
            self.assertIn("work = [ 1, 2, 3 ]", self.text())
            self.assertTrue(e.is_idle())
            self.assertEqual(os.listdir(self.directory), ["state"])

    def test_a_rig_has_one_for_each(self):
        rig = os.path.join(self.directory, "rig.cfg")
        with open(rig, "w", encoding="ascii") as file:
            file.write(f'controllers = ( {{ name = "a"; controller = "mpc"; state = "{self.path}"; }},\n'
                       f'{{ name = "b"; controller = "trio"; state = "{self.path}2"; }}, {{ name = "c"; controller = "mpc"; }} );')
        for i in range(2):
            process = emu.start("rig", rig, *STEP, *(["--do", "@b set home 1,2,3", "--do", "@a set position 5,6,7"] if i == 0 else []))
            paths = dict(word.split("=") for word in process.stdout.readline().decode().split()[1:])
            with Port(paths["a"]) as port:
                self.assertEqual(port.ask(b"C", 14)[1:13], point(5, 6, 7))
            process.terminate()
            process.communicate(timeout=emu.LIMIT_S)
            self.assertEqual(process.returncode, 0)
        with open(self.path + "2", encoding="ascii") as file:
            self.assertIn("home = [ 1, 2, 3 ]", file.read())
        with open(rig, "w", encoding="ascii") as file:
            file.write(f'controllers = ( {{ name = "a"; controller = "mpc"; state = "{self.path}"; }},\n'
                       f'{{ name = "b"; controller = "mpc"; state = "{self.path}"; }} );')
        status, _, error = emu.outcome("rig", rig)
        self.assertEqual(status, 2)
        self.assertIn("'a' has it already", error)

    def test_run(self):
        for expected in ("0", "1"):
            script = ("import os\nfd = os.open(os.environ['DRYRIG_PORT'], os.O_RDWR | os.O_NOCTTY)\nos.write(fd, b'C')\n"
                      "got = b''\nwhile len(got) < 14: got += os.read(fd, 14)\nprint(got[1])\n"
                      "os.write(fd, b'M' + bytes([1] + 11 * [0]))\nos.read(fd, 1)")
            done = subprocess.run([emu.PROGRAM, "run", "mpc", "--lint=off", "--state", self.path, "--", sys.executable, "-c", script],
                                  capture_output=True, check=False, timeout=emu.LIMIT_S)
            self.assertEqual((done.returncode, done.stdout.decode().strip(), done.stderr), (0, expected, b""))


class Killed(Files):
    def test_at_any_instant_it_leaves_one_of_the_states(self):
        random.seed(1)
        known = {(0, 0, 0)}
        target = 0
        for turn in range(60):
            process = emu.start("mpc", "--state", self.path, "--speedup", "100", "--pace", "off")
            path = process.stdout.readline().decode().split()[1]
            with Port(path) as port:
                at = tuple(int.from_bytes(port.ask(b"C", 14)[i:i + 4], "little") for i in (1, 5, 9))
                self.assertIn(at, known, turn)
                known = {at}
                end = time.monotonic() + random.random() * 0.03
                while time.monotonic() < end:
                    target = (target + 16) % 400000
                    known.add((target, 0, target % 7))
                    port.send(b"M" + point(target, 0, target % 7))
                    port.receive(1, 0.0005)
                process.kill()
            process.communicate()
            self.assertLessEqual(set(os.listdir(self.directory)), {"state", "state.new"})
        with Rehearsal("mpc", "--state", self.path) as e:
            self.assertIn(tuple(e.position()), known)
            e.do("set position 1,1,1")
            emu.wait_until(lambda: os.listdir(self.directory) == ["state"], "what was half written has been replaced")


class Refused(Files):
    def refused(self, *words, args=(), kind="mpc", status=2):
        before = None
        if os.path.isfile(self.path):
            with open(self.path, "rb") as file:
                before = file.read()
        got, out, error = emu.outcome(kind, "--state", self.path, "--link", self.directory + "/link", *args)
        self.assertEqual((got, out), (status, ""), error)
        for word in words:
            self.assertIn(word, error)
        if before is not None:
            with open(self.path, "rb") as file:
                self.assertEqual(file.read(), before)  # nothing is lost
        self.assertLessEqual(set(os.listdir(self.directory)), {"state"})

    def made(self, *args, kind="mpc"):
        with self.start(*args, kind=kind):
            pass
        return self.text()

    def test_what_is_damaged_or_somebody_else_s_is_refused_with_its_line(self):
        good = self.made()
        for text, words in (("", (":1:1: ", "dryrig_state")), ("hello\n", (":", "no state")), ("x = 1;\n", ("dryrig_state",)),
                            (good[:len(good) // 2], ("damaged",)), (good.replace("= 1;", "= 2;", 1), (":2:1: ", "version 1")),
                            (good.replace("MP-225", "MP-999", 1), (":6:7: ", "MP-225")),
                            (good.replace("[ 0, 0, 0 ]", "[ 0, 0, 400001 ]", 1), (":6:", "position", "400000")),
                            (good.replace("[ 0, 0, 0 ]", "[ 0, 0 ]", 1), (":6:", "3 numbers")),
                            (good.replace("[ 0, 0, 0 ]", "[ 0, 0, -1 ]", 1), (":6:", "from 0")),
                            (good.replace('"calibrated"', '"perhaps"', 1), (":6:", "uncalibrated")),
                            (good.replace("rear = [ 0", "rear = [ 2", 1), (":7:7: ", "0 to 1")),
                            (good.replace("roe = ", "rho = "), (":1:1: ", "roe")), (good + "more = 1;\n", ("more", "no such")),
                            (good.replace("position", "place", 1), ("position is missing",)),
                            (good.replace("    {", "    { what = 1;", 1), ("what", "no such"))):
            self.assertNotEqual(text, good)
            self.write(text)
            self.refused(self.path, *words)
        self.write(good + "\0")
        self.refused("byte 0")

    def test_what_does_not_fit_is_refused(self):
        self.made("--device", "MP-225", "--device", "MP-285")
        self.refused("'mpc'", kind="trio")
        self.refused("MP-285 was at port 2", args=("--device", "MP-225"))
        self.made("--device", "MP-225", "--device", "MP-285")
        os.unlink(self.path)
        self.made("--device", "MP-845")
        self.refused("3.19", args=("--firmware", "3.16"))

    def test_two_emulators_do_not_share_one(self):
        with self.start(clock=()) as e:
            status, _, error = emu.outcome("mpc", "--state", self.path)
            self.assertEqual(status, 1)
            self.assertIn("another emulator", error)
            link = os.path.join(self.directory, "same")
            os.symlink("state", link)
            self.assertEqual(emu.outcome("mpc", "--state", link)[0], 1)
            os.unlink(link)
            e.do("set position 1,1,1")
            emu.wait_until(lambda: "[ 1, 1, 1 ]" in self.text(), "written")
            self.assertEqual(emu.outcome("mpc", "--state", self.path)[0], 1)  # a new file by now, and still in use

    def test_what_cannot_be_a_file(self):
        os.mkdir(self.path)
        self.refused("directory")
        os.rmdir(self.path)
        status, _, error = emu.outcome("mpc", "--state", "/no/such/directory/state")
        self.assertEqual(status, 1)
        self.assertIn("/no/such/directory/state", error)
        self.assertEqual(emu.outcome("mpc", "--state", "")[0], 2)

    def test_a_link_and_the_rights_of_the_old_file_stay(self):
        self.made()
        os.chmod(self.path, 0o640)
        link = os.path.join(self.directory, "link")
        os.symlink("state", link)
        with Rehearsal("mpc", "--state", link, "--position", "9,9,9"):
            pass
        self.assertIn("[ 9, 9, 9 ]", self.text())
        self.assertTrue(os.path.islink(link))
        self.assertEqual(stat.S_IMODE(os.stat(self.path).st_mode), 0o640)

    def test_a_start_that_fails_leaves_no_file(self):
        self.refused("position 1", args=("--do", "set position 1,2"))
        self.refused("it is on", args=("--do", "power on"))
        self.assertEqual(os.listdir(self.directory), [])

    def test_a_disk_that_is_full_is_told_once_and_the_old_state_stays(self):
        self.made()
        before = self.text()
        with self.assertRaisesRegex(AssertionError, "exit status 1"), self.start(clock=()) as e:
            os.mkdir(self.path + ".new")
            for i in range(3):
                e.do(f"set position {i + 1},0,0")
            emu.wait_until(lambda: e.controller()["devices"][0]["position_steps"] == [3, 0, 0], "done")
            self.assertEqual(self.text(), before)
        self.assertEqual(e.err.count("cannot be kept"), 1)
        self.assertEqual(self.text(), before)
        with self.start(clock=()) as e:  # and once there is room, all is well
            e.do("set position 4,0,0")
            self.assertEqual(self.text(), before)
            os.rmdir(self.path + ".new")
        self.assertIn("[ 4, 0, 0 ]", self.text())


if __name__ == "__main__":
    emu.main()
