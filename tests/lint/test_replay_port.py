"""replay --port: the host's side of a recording, played to what is at a port; here that is another emulator."""
import json
import os
import signal
import subprocess
import sys
import unittest

import emu
import realtime
from ctl import Rehearsal, ctl

DRYRIG = os.environ["DRYRIG"]
STAGE = {"mpc": "MP-225", "trio": "MP-845"}
# [M] table 9: M and S answer a CR, C 14 bytes.
FAR = "".join(f"{byte:02X} " for byte in emu.point(400000, 400000, 400000)).strip()
HEAD = "dryrig-recording 1\nset mpc controller mpc\nset mpc device MP-225\n"
MOVE = f"0.010000 0.010000 mpc > 4D {FAR}\n8.343334 8.343334 mpc < 0D\n"
LINE = f"0.010000 0.010000 mpc > 53 0F\n0.040000 0.040000 mpc > {FAR}\n19.270770 19.270770 mpc < 0D\n"
ASK = "9.000000 9.000000 mpc > 4B\n9.001000 9.001000 mpc < 01 21 03 0D\n"


def replay(path, port, *options):
    done = subprocess.run([emu.PROGRAM, "replay", path, "--port", port, *options], stdin=subprocess.DEVNULL, capture_output=True,
                          text=True, timeout=3 * emu.LIMIT_S, check=False)
    return done.returncode, done.stdout, done.stderr


class Port(emu.InDirectory):
    def setUp(self):
        super().setUp()
        self.path = os.path.join(self.directory, "line.rec")

    def write(self, text):
        with open(self.path, "w", encoding="ascii") as file:
            file.write(text)

    def record(self, kind, *options):
        program = f"{DRYRIG} -p $DRYRIG_PORT -c {kind} -s {STAGE[kind]} "
        words = ["info", "move 100 200 50", "line 110 210 60 --speed 15", "home", "position"]
        if kind == "mpc":
            words[2] += " --stream"
        for _ in range(3):  # on a busy machine dryrig may give up waiting and ask again: that is another recording
            done = subprocess.run([emu.PROGRAM, "run", kind, "--record", self.path, "--position", "160,160,160", "--strict", *options,
                                   "--", "sh", "-ec", "\n".join(program + line for line in words)],
                                  check=False, capture_output=True, timeout=emu.LIMIT_S)
            if done.returncode == 0:
                return
        self.fail(done)

    def test_the_same_controller_gives_the_same_answers(self):
        for kind in STAGE:
            for options in ((), ("--clock", "jump")):
                with self.subTest(f"{kind} {options}"):
                    self.record(kind, *options)
                    with Rehearsal(kind, "--position", "160,160,160", *options, "--lint-json", self.path + ".lint") as e:
                        status, out, err = replay(self.path, e.path, "--may-move")
                    self.assertEqual((0, ""), (status, err), out)
                    self.assertRegex(out, rf"^{kind}: 0 of \d\d answers differ\.\n$")
                    with open(self.path + ".lint", encoding="utf-8") as file:
                        self.assertEqual([], json.load(file)["findings"])

    def test_another_place_is_told_and_it_goes_on(self):
        self.record("trio")
        with Rehearsal("trio", "--position", "160,160,161") as e:
            status, out, _ = replay(self.path, e.path, "--may-move")
        self.assertEqual(1, status)
        self.assertRegex(out, r"line\.rec:\d+: after 'tell position and angle'")
        self.assertRegex(out, r"recorded:  A0 00 00 00 A0 00 00 00 A0 00 .* Z 15\.0 um \(160\)")
        self.assertRegex(out, r"replayed:  A0 00 00 00 A0 00 00 00 A1 00 .* Z 15\.0938 um \(161\)")
        self.assertRegex(out, r"trio: [1-9]\d* of \d\d answers differ\.\n$")

    def test_nothing_is_sent_before_somebody_says_that_it_may_move(self):
        self.write(HEAD + MOVE + ASK)
        with Rehearsal("mpc") as e:
            status, out, err = replay(self.path, e.path)
            self.assertEqual((2, ""), (status, out))
            self.assertIn(f"nothing was sent. The recording has 2 commands for what is at {e.path}, of which 1 moves it", err)
            self.assertFalse(e.controller()["is_open"])
            self.assertEqual([0, 0, 0], e.position())

    def test_what_cannot_be_played(self):
        with Rehearsal("mpc") as e:
            for text, why in ((HEAD + MOVE + "9.000000 9.000000 trio > 63\n", "line.rec:6: a second controller"),
                              (HEAD + "0.000000 0.000000 mpc > 4D 00\n", "line.rec:4: it ends within a command"),
                              (HEAD + MOVE[:-4], "line.rec:5: the line is torn"), (HEAD[:19] + MOVE, "line.rec:2: which controller?"),
                              ("", "line.rec:0: it is empty")):
                self.write(text)
                status, out, err = replay(self.path, e.path, "--may-move")
                self.assertEqual((2, ""), (status, out), text)
                self.assertIn(why, err)
            self.write(HEAD + MOVE)
            self.assertEqual(1, replay(self.path, os.path.join(self.directory, "none"), "--may-move")[0])
            for options in (("--to-host", "--port", e.path), ("--may-move",)):
                done = subprocess.run([emu.PROGRAM, "replay", self.path, *options], capture_output=True, check=False)
                self.assertEqual(2, done.returncode)
            self.assertEqual(2, subprocess.run([emu.PROGRAM, "mpc", "--port", e.path], capture_output=True, check=False).returncode)
            self.assertEqual([0, 0, 0], e.position())

    def test_an_answer_that_does_not_come_ends_it(self):
        self.write(HEAD + ASK + MOVE.replace("0.010000", "9.100000").replace("8.343334", "9.200000"))
        with Rehearsal("mpc", "--do", "fault drop-cr on active") as e:
            status, out, _ = replay(self.path, e.path, "--may-move")
            self.assertEqual(1, status)
            self.assertIn("replayed:  01 21 03  ", out)
            self.assertIn("it ended at line 6", out)
            self.assertIn("an answer has not come", out)
            self.assertEqual([0, 0, 0], e.position())  # nothing more was sent

    def interrupt(self, text, *wanted):
        """When the controller has got the first of these pieces; then the others come."""
        self.write(text)
        with Rehearsal("mpc") as e:
            e.do("subscribe")
            process = subprocess.Popen([emu.PROGRAM, "replay", self.path, "--port", e.path, "--may-move"], stdout=subprocess.PIPE)
            for piece in wanted:
                while not json.loads(e.lines.readline()).get("bytes", "").startswith(piece):  # what follows may come with it
                    pass
                process.send_signal(signal.SIGINT)
            out = process.communicate(timeout=emu.LIMIT_S)[0].decode()
            self.assertEqual(1, process.returncode)
            self.assertIn("a signal came", out)
            self.assertIn("^C was sent, and a CR has come", out)
            controller = json.loads(ctl(e.socket_path, "state")[1])["controllers"][0]
            self.assertEqual("rest", controller["state"])
            self.assertLess(controller["devices"][0]["position_steps"][0], 400000)
            with emu.Port(e.path) as port:  # it waits for no rest of a command
                self.assertEqual(emu.ACTIVE[1], port.ask(emu.ACTIVE[0], 4))

    def test_a_signal_stops_what_moves(self):
        self.interrupt(HEAD + MOVE + ASK, f"4D {FAR}")

    def test_a_signal_within_a_command_comes_when_that_is_whole(self):
        self.interrupt(HEAD + LINE.replace("0.040000", "0.540000"), "53 0F", FAR)

    def test_a_port_that_goes(self):
        self.write(HEAD + MOVE)
        with Rehearsal("mpc", "--do", "on M in 100ms usb unplug") as e:
            status, out, _ = replay(self.path, e.path, "--may-move")
        self.assertEqual(1, status)
        self.assertIn("the port has failed", out)
        self.assertIn("look at the stage: it may move", out)

    def test_a_port_that_somebody_has(self):
        self.write(HEAD + MOVE)
        with Rehearsal("mpc") as e:
            holder = subprocess.Popen([sys.executable, "-c",
                                       "import fcntl, os, sys; fd = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY);"
                                       "fcntl.flock(fd, fcntl.LOCK_EX); print('has it', flush=True); sys.stdin.read()", e.path],
                                      stdin=subprocess.PIPE, stdout=subprocess.PIPE)
            holder.stdout.readline()
            status, _, err = replay(self.path, e.path, "--may-move")
            holder.communicate()
        self.assertEqual(1, status)
        self.assertIn("in use", err)


if __name__ == "__main__":
    unittest.main()
