"""dryrig-guard --record: what went over the controller's line, for `dryrig-emu replay` and `dryrig decode`."""
import os
import resource
import signal
import subprocess

import emu
import guard
import realtime
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


class Recording(realtime.TestCase):
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
                         ("--log", directory + "/log", "--record", directory),
                         ("--record", self.path)):  # a slip must not cost a configuration or a log
                status, out, err = guard.run(*base, *more)
                self.assertEqual((status, out), (1, ""), err)
                self.assertEqual(os.listdir(directory), ["rig.conf"])
            self.assertEqual(read(conf), rig(guard.MPC))
            self.assertIn("holds something else than a recording: it stays", err)
        self.assertEqual(read(self.path), "precious")

    def test_who_is_killed_has_recorded_all_that_went_over_the_line(self):
        with emu.directory() as directory, emu.Emulator("mpc", *FAST, "--position", "10um,20um,30um") as e:
            g = Guard(directory, e.path, rig(guard.MPC), "--record", self.path)
            with emu.Port(g.path) as port:
                replies = [port.ask(b"C", 14) for _ in range(3)]
                g.status() # what was under way then is done
                g.kill()
        lines = read(self.path).splitlines(keepends=True)
        self.assertTrue(lines[-1].endswith("\n"), lines[-1])
        told = b"".join(bytes.fromhex(line.split(" < ")[1]) for line in lines if " < " in line)
        self.assertTrue(told.endswith(b"".join(replies)), lines)
        self.replays(r"mpc: 0 of \d answers differ")

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


class Replaying(realtime.TestCase):
    """A log is enough to replay what happened on the controller's line."""

    def told(self, g):
        path = os.path.join(os.path.dirname(g.log), "log.rec")
        status, out, err = guard.run("log", g.log, "--config", g.config, "--record", path)
        self.assertEqual((status, out, err), (0, "", ""))
        status, out, err = run("DRYRIG_EMU", "replay", path)
        self.assertEqual((status, err), (0, ""), out + read(path))
        return read(path), out

    def test_an_mpc(self):
        with guarded("mpc", rig(guard.MPC, high=2000), "--position", "1100um,50um,7um") as (_, g, port):
            for question, count in ((b"C", 14), (b"K", 4), (b"U", 6), (b"L\x03", 1), (move_mpc(1100, 60, 7), 1),
                                    (line(15, 1150, 60, 7), 1), (b"\x03", 1), (b"I\x01", 2), (b"C", 14)):
                self.assertEqual(len(port.ask(question, count)), count)
            port.send(move_mpc(2001, 0, 0))
            emu.wait_until(lambda: g.status()["refused"] == 1, "the refusal")
            g.stop()
            text, out = self.told(g)
        self.assertRegex(out, r"mpc: 0 of \d\d answers differ")
        self.assertRegex(text, r" mpc - refused: host 4D 10 7D 00 00 .*; limit on axis X\n")

    def test_a_trio_twice(self):
        with emu.directory() as directory, emu.Emulator("trio", "--angle", "60") as e:
            with Guard(directory, e.path, rig(guard.TRIO)) as g:
                for _ in range(2):
                    with emu.Port(g.path) as port:
                        g.arm()
                        for question, count in ((b"x" + POINT(12000, 0, 0)[:4], 1), (b"A\x2d", 1),
                                                (b"W" + POINT(11800, 10600, 10100), 1), (b"C", 14)):
                            self.assertEqual(len(port.ask(question, count)), count)
                    g.stop()
                    text, out = self.told(g)
                    g.start()
                g.stop()
                text, out = self.told(g)
        self.assertRegex(out, r"trio: 0 of \d\d answers differ")
        self.assertRegex(out, r"trio\.2: 0 of \d\d answers differ")
        self.assertRegex(out, r"trio\.3: 0 of \d answers differ")
        self.assertIn("set trio.2 device MP-845\n", text)

    def test_a_move_that_is_so_short_that_no_CR_comes(self):
        with guarded("mpc", rig(guard.MPC), "--quirks", "small-move-silent") as (_, g, port):
            port.send(b"M" + POINT(3, 0, 0)) # 3 microsteps [P]
            emu.wait_until(lambda: g.status()["state"] == "armed" and g.status()["forwarded"] == 1, "its end")
            self.assertEqual(len(port.ask(b"C", 14)), 14)
            g.stop()
            path = g.log + ".rec"
            self.assertEqual(guard.run("log", g.log, "--config", g.config, "--record", path)[0], 0)
            self.assertRegex(read(path), r" > 4D 03 00 00 00 00 00 00 00 00 00 00 00\n[^<]* mpc > 43\n")

    def test_what_did_not_leave_is_not_told(self):
        with guarded("mpc", rig(guard.MPC, more="knob_um_per_s = 20000;").replace("knobs_locked = true; ", "")) as (_, g, port):
            port.send(line(0, 2000, 0, 0))
            g.wait_for("moving")
            g.order("stop")
            g.wait_for("stopped")
            g.order("clear")
            g.arm()
            self.assertEqual(port.ask(line(15, 10, 0, 0), 1), b"\r")
            g.stop()
            path = g.log + ".rec"
            self.assertEqual(guard.run("log", g.log, "--config", g.config, "--record", path)[0], 0)
            text = read(path)
            with open(g.log, encoding="utf-8") as file:
                moved = sum("checking to moving" in row for row in file)
            self.assertEqual((text.count(" mpc > 53 "), moved), (2, 2))
            self.assertRegex(text, r" mpc > 53 00\n[^>]* mpc > 00 7D 00 00 ") # the guard's pause is in it
            self.assertRegex(text, r" mpc > 03\n(.* mpc - .*\n)* *[0-9.]+ [0-9.]+ mpc < 0D\n")
            for what, wanted in (("decode", "DRYRIG"), ("replay", "DRYRIG_EMU")):
                self.assertIn(run(wanted, what, path)[0], (0, 1)) # where the stop left it is a matter of microseconds

    def test_what_cannot_be_told(self):
        with guarded("mpc", rig(guard.MPC)) as (_, g, _):
            g.stop()
            out = g.log + ".rec"
            other = g.config + ".other"
            with open(other, "w", encoding="ascii") as file:
                file.write(rig(guard.MPC, margin=1))
            for status, words, *args in ((2, "--record needs --config", "--record", out), (2, "the other way round", "--config", g.config),
                                         (4, "1 of other ones", "--config", other, "--record", out),
                                         (1, "No such file", "--config", g.config, "--record", "/nowhere/x"),
                                         (3, "No such file", "--config", "/nowhere/x", "--record", out)):
                code, _, err = guard.run("log", g.log, *args)
                self.assertEqual((args, code), (args, status))
                self.assertIn(words, err)
            self.assertEqual(guard.run("log", "/nowhere/x")[0], 1)
            self.assertEqual(guard.run("log", "/")[0], 4)


if __name__ == "__main__":
    guard.main()
