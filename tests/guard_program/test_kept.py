"""dryrig-guard --record: what went over the controller's line, for `dryrig-emu replay` and `dryrig decode`."""
import os
import resource
import signal
import subprocess
import unittest

import emu
import guard
from guard import Guard, guarded, line, move_mpc, rig

FAST = ("--pace", "off")
POINT = emu.point


def run(program, *args):
    done = subprocess.run([os.environ[program], *args], stdin=subprocess.DEVNULL, capture_output=True, timeout=emu.LIMIT_S,
                          check=False)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def read(path):
    with open(path, encoding="ascii") as file:
        return file.read()


class Recording(unittest.TestCase):
    def setUp(self):
        where = emu.contextlib.ExitStack()
        self.addCleanup(where.close)
        self.path = os.path.join(where.enter_context(emu.directory()), "line.rec")

    def replays(self, words):
        status, out, err = run("DRYRIG_EMU", "replay", self.path)
        self.assertEqual((status, err), (0, ""), out)
        self.assertRegex(out, words)

    def test_an_mpc_replays_with_the_guards_own_queries_in_it(self):
        with guarded("mpc", rig(guard.MPC, high=2000), "--position", "1100um,50um,7um", guard_args=("--record", self.path)) as (
                _, g, port):
            for question, count in ((b"C", 14), (b"K", 4), (b"U", 6), (move_mpc(1100, 60, 7), 1), (line(15, 1150, 60, 7), 1)):
                self.assertEqual(len(port.ask(question, count)), count)
            port.send(move_mpc(2001, 0, 0)) # refused: it is not on the controller's line
            emu.wait_until(lambda: g.status()["refused"] == 1, "the refusal")
            self.assertEqual(len(port.ask(b"C", 14)), 14)
        text = read(self.path)
        self.assertIn("dryrig-recording 1\nset mpc controller mpc\nset mpc firmware 3.21\nset mpc device MP-225\n", text)
        self.assertIn(" mpc > 53 0F\n", text) # the pause behind the speed is the guard's [M table 9, note]
        self.assertNotIn("12 7D 00 00", text) # 2,001 um
        self.replays(r"mpc: 0 of \d\d answers differ")
        status, out, err = run("DRYRIG", "decode", self.path)
        self.assertEqual((status, err), (0, ""))
        self.assertIn("1,150", out)

    def test_a_trio_replays_from_where_it_stood_at_its_angle(self):
        with guarded("trio", rig(guard.TRIO), "--position", "1100um,50um,7um", "--angle", "60", "--firmware", "3.12",
                     guard_args=("--record", self.path)) as (_, _, port):
            for question, count in ((b"C", 14), (b"x" + POINT(12000, 0, 0)[:4], 1), (b"H" + POINT(11800, 600, 100), 1), (b"C", 14)):
                self.assertEqual(len(port.ask(question, count)), count)
        self.replays(r"trio: 0 of \d\d? answers differ")

    def test_a_fifo_that_nobody_reads_holds_nobody_up(self):
        os.mkfifo(self.path)
        with guarded("mpc", rig(guard.MPC), *FAST, guard_args=("--record", self.path)) as (_, g, port):
            for _ in range(1500):
                self.assertEqual(port.ask(b"C", 14)[-1:], b"\r")
            self.assertEqual(port.ask(move_mpc(1, 2, 3), 1), b"\r")
            self.assertEqual(g.order("stop")["ok"], True)
            self.assertEqual(g.err().count("nobody reads the recording"), 1)

    def test_a_recording_that_cannot_go_on_ends_alone(self):
        def small_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (12000, 12000))
        with emu.directory() as directory, emu.Emulator("mpc", *FAST) as e:
            with Guard(directory, e.path, rig(guard.MPC), "--record", self.path, preexec_fn=small_files) as g:
                with emu.Port(g.path) as port:
                    for _ in range(400):
                        self.assertEqual(len(port.ask(b"C", 14)), 14)
                emu.wait_until(lambda: "the recording ends here" in g.err(), "the words")
                self.assertEqual(g.err().count("the recording ends here"), 1)

    def test_a_start_that_fails_empties_no_recording(self):
        with open(self.path, "w", encoding="ascii") as file:
            file.write("precious")
        with emu.directory() as directory, emu.Emulator("mpc") as e:
            conf = os.path.join(directory, "rig.conf")
            with open(conf, "w", encoding="ascii") as file:
                file.write(rig(guard.MPC))
            base = ("--port", e.path, "--config", conf, "--link", directory + "/host")
            for more in (("--log", "/dev/null", "--record", self.path), ("--log", directory + "/log", "--record", "/dev/full"),
                         ("--log", directory + "/log", "--record", directory)):
                status, out, err = guard.run(*base, *more)
                self.assertEqual((status, out), (1, ""), err)
                self.assertEqual(os.listdir(directory), ["rig.conf"])
        self.assertEqual(read(self.path), "precious")

    def test_the_port_lost_and_found_is_told(self):
        with emu.directory() as directory:
            link = directory + "/emu"
            first = emu.Emulator("mpc", *FAST, "--link", link)
            with Guard(directory, link, rig(guard.MPC), "--record", self.path) as g:
                first.stop(signal.SIGKILL)
                g.wait_for("locked")
                with emu.Emulator("mpc", *FAST, "--link", link):
                    g.wait_for("disarmed")
        self.assertRegex(read(self.path), r"(?s) mpc - .*/emu: it is gone.*\n.* mpc - the port is there\n.* mpc > 43\n")
        self.replays("3 lines of events are told in the recording, not played")


if __name__ == "__main__":
    guard.main()
