"""run, lint, --record and replay through the port: programs that are right, and the example of docs/ci.md, which is not."""
import json
import multiprocessing.pool
import os
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

import realtime

EMULATOR = os.environ["DRYRIG_EMU"]
DRYRIG = os.environ["DRYRIG"]
EXAMPLE = os.environ["CI_EXAMPLE"]
LIMIT_S = 100

# Every command of the command line, for each controller.
RIGHT = {
    "mpc": ["info", "position", "move 1000 2000 500", "line 100 200 300 --speed 15", "line 200 300 400 --speed 15 --stream",
            "home", "work", "stop", "mode 3", "select 2", "calibrate", "axis x 100"],
    "trio": ["info", "position", "move 1000 2000 500", "line 100 200 300 --speed 15", "home", "work", "stop", "angle 45",
             "calibrate", "axis x 100", "axis y 200", "axis z 1"],
}
RECORDED = {
    "mpc": ["move 100 200 50", "line 200 300 400 --speed 15 --stream", "select 2"],
    "trio": ["info", "line 100 200 300 --speed 15", "work"],
}
STAGE = {"mpc": "MP-225", "trio": "MP-845"}


def emulator(*args):
    done = subprocess.run([EMULATOR, *args], stdin=subprocess.DEVNULL, capture_output=True, timeout=LIMIT_S, check=False)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def script(kind, commands):
    program = f"{DRYRIG} -p $DRYRIG_PORT -c {kind} -s {STAGE[kind]} "
    return ["sh", "-ec", "\n".join(program + words for words in commands)]


def example(name):
    return [sys.executable, os.path.join(EXAMPLE, name)]


class Lint(realtime.TestCase):
    def test_the_command_line_breaks_no_rule(self):
        for kind in RIGHT:
            with self.subTest(kind):
                status, _, err = emulator("run", kind, "--clock", "jump", "--work", "160,160,160", "--strict", "--",
                                          *script(kind, RIGHT[kind]))
                self.assertEqual((0, ""), (status, err))

    def test_the_command_line_breaks_no_rule_whatever_goes_wrong(self):
        """Every fault, at its first command or a later one: what it does then may fail, but keeps the rules."""
        def one(what):
            kind, fault, skipped = what
            when = f"after {skipped} commands fault {fault}" if skipped else f"fault {fault}"
            commands = ["move 500 400 300", "line 10 20 30 --speed 9" + (" --stream" if kind == "mpc" else "")]
            return what, emulator("run", kind, "--do", when, "--", "sh", "-c", script(kind, commands)[2].replace("\n", ";"))

        _, listed, _ = emulator("run", "mpc", "--", "sh", "-c", f'{EMULATOR} ctl "$DRYRIG_CONTROL" faults')
        names = [fault["fault"] + (" y" if fault["takes_axis"] else "") for fault in json.loads(listed)["faults"]]
        self.assertGreater(len(names), 15)
        with multiprocessing.pool.ThreadPool(4) as pool:
            for what, (_, _, err) in pool.imap_unordered(one, [(kind, name, (number + offset) % 2 * 2) for number, name in enumerate(names)
                                                               for offset, kind in enumerate(RIGHT)]):
                self.assertNotIn("dryrig-emu lint", err, what)

    def test_the_example_passes_with_a_fake_port(self):
        done = subprocess.run([sys.executable, "test_fake.py"], cwd=EXAMPLE, capture_output=True, timeout=LIMIT_S,
                              check=False)
        self.assertEqual(0, done.returncode, done.stderr)

    def test_the_example_has_a_controller_for_each_test(self):
        done = subprocess.run([sys.executable, "test_stage.py"], cwd=EXAMPLE, capture_output=True, timeout=LIMIT_S,
                              check=False)
        self.assertEqual(0, done.returncode, done.stderr)

    def test_the_bugs_of_the_example_are_found(self):
        with tempfile.TemporaryDirectory() as where:
            as_json, as_xml = os.path.join(where, "lint.json"), os.path.join(where, "lint.xml")
            status, _, err = emulator("run", "mpc", "--strict", "--lint-json", as_json, "--lint-junit", as_xml, "--",
                                      *example("stage.py"))
            self.assertEqual(3, status, err)
            with open(as_json, encoding="utf-8") as file:
                report = json.load(file)
            found = {finding["name"] for finding in report["findings"]}
            self.assertEqual({"no-pause-in-s", "thirteen-bytes", "query-in-move"}, found - {"unread-reply"})
            pause = next(f for f in report["findings"] if f["name"] == "no-pause-in-s")
            self.assertEqual("53 0F 80 3E 00 00 80 3E 00 00 40 1F 00 00", pause["bytes"])
            self.assertEqual(len(report["findings"]), report["count"])
            suite = xml.etree.ElementTree.parse(as_xml).getroot().find("testsuite")
            self.assertEqual(len(report["rules"]), int(suite.get("tests")))
            failed = {case.get("name").split()[1] for case in suite if case.find("failure") is not None}
            self.assertEqual(found, failed)
            for name in found:
                self.assertIn(name, err)

    def test_the_example_without_its_bugs_breaks_no_rule(self):
        for clock in ("real", "jump"):
            with self.subTest(clock):
                status, _, err = emulator("run", "mpc", "--strict", "--clock", clock, "--", *example("stage_fixed.py"))
                self.assertEqual((0, ""), (status, err))

    def test_thirteen_bytes_of_each_position(self):
        """However quick the program is, and what was seen of it when: it is one bug, and has one name."""
        program = ("import os, serial, sys, time\np = serial.Serial(os.environ['DRYRIG_PORT'], 128000, timeout=5)\n"
                   "for _ in range(5):\n    time.sleep(float(sys.argv[1]))\n    p.write(b'C')\n    p.read(13)\np.close()\n")
        for clock, pause in (("jump", "0"), ("jump", "0.003"), ("jump", "0.02"), ("real", "0.003"), ("real", "0.02")):
            with self.subTest(f"{clock} {pause}"):
                _, _, err = emulator("run", "mpc", "--clock", clock, "--", sys.executable, "-c", program, pause)
                self.assertEqual(["16 thirteen-bytes, 5 times"], re.findall(r"^\d.*", err, re.MULTILINE), err)

    def test_a_program_that_asks_and_leaves(self):
        """What it wrote before it left is judged as the program's, whenever one gets to look."""
        program = ("import os, serial; p = serial.Serial(os.environ['DRYRIG_PORT'], 128000, timeout=5)\n"
                   "p.write(b'K'); p.read(4); p.write(b'C'); p.close()")
        for clock in ("real", "jump", "step"):
            for _ in range(5):
                _, _, err = emulator("run", "mpc", "--clock", clock, "--", sys.executable, "-c", program)
                found = re.findall(r"^\d+ (.*), 1 time$", err, re.MULTILINE)
                self.assertEqual({"unread-reply"}, set(found) - {"hurried-command"}, err)

    def test_strict_changes_nothing_but_0(self):
        burst = "exec 3<>$DRYRIG_PORT; printf 'CC' >&3; dd bs=28 count=1 iflag=fullblock <&3 2>&1 >/dev/null; exit "
        for wanted, options in ((0, []), (3, ["--strict"]), (0, ["--lint=off"])):
            self.assertEqual(wanted, emulator("run", "mpc", *options, "--", "sh", "-c", burst + "0")[0])
        self.assertEqual(7, emulator("run", "mpc", "--strict", "--", "sh", "-c", burst + "7")[0])
        self.assertIn("early-command", emulator("run", "mpc", "--", "sh", "-c", burst + "0")[2])
        self.assertEqual("", emulator("run", "mpc", "--lint=off", "--", "sh", "-c", "exit 0")[2])
        self.assertEqual(2, emulator("mpc", "--strict")[0])

    def test_a_stop_that_a_jumping_clock_makes_late(self):
        """A correct program: M, ^C 50 ms later, one CR, and on. Where time goes the move of 8 s is stopped, and all is well."""
        program = ("import os, serial, time\np = serial.Serial(os.environ['DRYRIG_PORT'], 128000, timeout=60)\n"
                   "def ask(data, count):\n    time.sleep(0.003)\n    p.write(data)\n    p.read(count)\n"
                   "time.sleep(0.003)\np.write(b'M' + bytes([128, 26, 6, 0] * 3))\ntime.sleep(0.05)\n"
                   "ask(b'\\x03', 1)\nask(b'C', 14)\nask(b'U', 6)\nask(b'K', 4)\n")
        for options, wanted in (((), ""), (("--clock", "jump"), "with --clock jump a move was over before its ^C came. 1 time "),
                                (("--speedup", "1000"), "with --speedup a move was over before its ^C came. 1 time ")):
            status, _, err = emulator("run", "mpc", *options, "--strict", "--", sys.executable, "-c", program)
            self.assertEqual((0, wanted == ""), (status, err == ""), err)
            self.assertIn(wanted, err)

    def test_a_baud_rate_that_the_controller_does_not_have(self):
        program = "import os, serial; p = serial.Serial(os.environ['DRYRIG_PORT'], {}); p.write(b'c'); p.read(14)"
        for baud, wanted in ((9600, True), (57600, False)):
            _, _, err = emulator("run", "trio", "--", sys.executable, "-c", program.format(baud))
            self.assertEqual(wanted, "wrong-baud" in err, err)


class Trace(realtime.TestCase):
    def test_json_lines(self):
        with tempfile.TemporaryDirectory() as where:
            path = os.path.join(where, "trace.jsonl")
            status, _, err = emulator("run", "trio", "--trace", path, "--", "sh", "-c",
                                      "exec 3<>$DRYRIG_PORT; printf c >&3; dd bs=14 count=1 iflag=fullblock <&3 2>&1 >/dev/null")
            self.assertEqual(0, status, err)
            with open(path, encoding="utf-8") as file:
                lines = [json.loads(line) for line in file]
        requests = [line for line in lines if line.get("note") == "request"]
        self.assertEqual(["63"], [line["bytes"] for line in requests])
        self.assertEqual("position", requests[0]["command"])


class Recordings(realtime.TestCase):
    def setUp(self):
        self.where = tempfile.TemporaryDirectory()
        self.path = os.path.join(self.where.name, "line.rec")

    def tearDown(self):
        self.where.cleanup()

    def record(self, kind, *options):
        status, _, err = emulator("run", kind, "--record", self.path, *options, "--",
                                  *script(kind, RECORDED[kind]))
        self.assertEqual(0, status, err)

    def test_what_is_recorded_is_replayed_to_the_byte_and_the_microsecond(self):
        for kind in RIGHT:
            for clock in (("--clock", "jump"), ("--speedup", "20")):
                with self.subTest(f"{kind} {clock}"):
                    self.record(kind, *clock, "--work", "160,160,160")
                    status, out, err = emulator("replay", self.path)
                    self.assertEqual((0, ""), (status, err), out)
                    self.assertRegex(out, rf"{kind}: 0 of \d\d+ answers differ; they came when recorded\.")

    def test_quirks_and_positions_are_recorded(self):
        status, _, err = emulator("run", "mpc", "--record", self.path, "--quirks", "position-13,nul-heartbeat", "--device",
                                  "MP-845", "--position", "16,17,18", "--angle", "14more", "--", "sh", "-c",
                                  "exec 3<>$DRYRIG_PORT; printf C >&3; dd bs=13 count=1 iflag=fullblock <&3 2>&1 >/dev/null")
        self.assertEqual(0, status, err)
        with open(self.path, encoding="ascii") as file:
            lines = file.read().splitlines()
        for line in ("set mpc device MP-845", "set mpc position 16,17,18", "set mpc angle 14more",
                     "set mpc quirks position-13,nul-heartbeat", "set mpc pace on"):
            self.assertIn(line, lines)
        self.assertEqual(0, emulator("replay", self.path)[0])

    def test_where_a_controller_stood_is_learned_from_what_it_first_told(self):
        """A recording of a real controller does not begin with it."""
        for kind in RIGHT:
            with self.subTest(kind):
                status, _, err = emulator("run", kind, "--record", self.path, "--speedup", "20", "--position", "1600,32,48", "--angle",
                                          {"mpc": "14more", "trio": "60"}[kind], "--",
                                          *script(kind, ["position", "move 100 200 50", "line 200 300 400 --speed 15"]))
                self.assertEqual(0, status, err)
                with open(self.path, encoding="ascii") as file:
                    text = file.read()
                known = re.sub(rf"set {kind} (position|angle) .*\n", "", text)
                self.assertNotEqual(text, known)
                with open(self.path, "w", encoding="ascii") as file:
                    file.write(known)
                status, out, err = emulator("replay", self.path)
                self.assertEqual((0, ""), (status, err), out)

    def test_a_difference_names_both_sides_and_goes_on(self):
        self.record("trio", "--clock", "jump")
        with open(self.path, encoding="ascii") as file:
            lines = file.readlines()
        first = next(i for i, line in enumerate(lines) if " < " in line)
        lines[first] = lines[first].replace(" < AB 29", " < AC 29")
        with open(self.path, "w", encoding="ascii") as file:
            file.writelines(lines)
        status, out, _ = emulator("replay", self.path)
        self.assertEqual(1, status)
        self.assertIn("recorded:  AC 29 00 00", out)
        self.assertIn("replayed:  AB 29 00 00", out)
        self.assertRegex(out, r"trio: 1 of \d\d+ answers differ; the others came when recorded")

    def test_the_command_line_records_at_its_own_end(self):
        status, _, err = emulator("run", "mpc", "--device", "MP-225", "--", DRYRIG, "-c", "mpc", "-s", "MP-225",
                                  "--record", self.path, "line", "10", "20", "30", "--speed", "5", "--stream")
        self.assertEqual((0, ""), (status, err))
        status, out, _ = emulator("replay", self.path)
        self.assertEqual(0, status, out)
        self.assertRegex(out, r"mpc: 0 of \d\d answers differ; they came up to \d+ us (earlier|later) than recorded")

    def test_behind_a_difference_the_rest_is_compared_afresh(self):
        self.record("mpc", "--clock", "jump", "--work", "160,160,160")
        with open(self.path, encoding="ascii") as file:
            text = file.read()
        with open(self.path, "w", encoding="ascii") as file:  # other positions are streamed, for longer
            file.write(text.replace("set mpc position 0,0,0\n", "set mpc position 16,0,90000\n", 1))
        status, out, _ = emulator("replay", self.path)
        self.assertEqual(1, status)
        self.assertRegex(out, r"mpc: [2-6] of \d\d answers differ")

    def test_what_is_no_recording(self):
        for text, wanted in (("", "line.rec:0: it is empty"), ("\x7fELF\n", "line.rec:1: it is no recording"),
                             ("dryrig-recording 1\n0.000000 0.000000 a > 43\n", "line.rec:2: which controller?"),
                             ("dryrig-recording 1\nset a controller xyz\n0.000000 0.000000 a > 43\n", "line.rec:3: "),
                             ("dryrig-recording 1\nset a colour red\n", "line.rec:2: no such setting")):
            with open(self.path, "w", encoding="ascii") as file:
                file.write(text)
            status, _, err = emulator("replay", self.path)
            self.assertEqual(2, status)
            self.assertIn(wanted, err)
        status, _, err = emulator("replay", "/nowhere/to.be")
        self.assertEqual(2, status)

    def test_it_can_be_explained(self):
        self.record("mpc", "--clock", "jump", "--work", "160,160,160")
        done = subprocess.run([DRYRIG, "decode", self.path], capture_output=True, timeout=LIMIT_S, check=False)
        self.assertEqual((0, b""), (done.returncode, done.stderr))
        self.assertIn(b"make active drive 2", done.stdout)


if __name__ == "__main__":
    unittest.main()
