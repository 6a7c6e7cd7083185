"""Starting and ending dryrig-guard: exit statuses, what is left behind, kill -9 of everybody in every order."""
import os
import re
import shlex
import signal
import stat
import subprocess

import emu
import guard
import realtime
from guard import Guard, line, position_mpc, rig


def config_file(directory, text=None):
    path = os.path.join(directory, "rig.conf")
    with open(path, "w", encoding="ascii") as file:
        file.write(rig(guard.MPC) if text is None else text)
    return path


class Failing(realtime.TestCase):
    def fails(self, directory, status, words, *args):
        before = sorted(os.listdir(directory))
        code, out, err = guard.run(*args)
        self.assertEqual((code, out), (status, ""), err)
        for word in words:
            self.assertIn(word, err)
        self.assertEqual(sorted(os.listdir(directory)), before)

    def test_wrong_options(self):
        with emu.directory() as directory:
            conf = config_file(directory)
            self.fails(directory, 2, ["--port is missing"], "--config", conf)
            self.fails(directory, 2, ["--config is missing"], "--port", "/dev/null")
            self.fails(directory, 2, ["--port is given twice"], "--port", "a", "--port", "b", "--config", conf)
            self.fails(directory, 2, ["'go' is no option"], "go", "--port", "a", "--config", conf)
            self.fails(directory, 2, ["expected a socket and an order"], "ctl", "x")
            self.fails(directory, 2, ["which file?"], "check")
            self.fails(directory, 2, ["expected a configuration and a command"], "explain", conf)
            self.fails(directory, 2, ["--drive 5"], "explain", conf, "--drive", "5", "home")

    def test_a_wrong_configuration(self):
        with emu.directory() as directory:
            conf = config_file(directory, rig(guard.MPC).replace("margin_um", "margin"))
            self.fails(directory, 3, [f"{conf}:3: 'margin' has no unit"], "--port", "/dev/null", "--config", conf)
            self.fails(directory, 3, [f"{conf}:3: 'margin' has no unit"], "check", conf)
            self.fails(directory, 3, ["No such file"], "check", conf + "x")
            conf = config_file(directory, rig(guard.MPC, more="relay = true;"))
            self.fails(directory, 3, ["'relay' is for a guard on a board"], "--port", "/dev/null", "--config", conf)
            self.assertIn("relay: for a guard on a board", guard.run("check", conf)[1])

    def test_a_port_that_is_none_or_somebody_elses(self):
        with emu.directory() as directory, emu.Emulator("mpc") as e:
            conf = config_file(directory)
            rest = ("--config", conf, "--link", directory + "/host", "--control", directory + "/ctl", "--log", directory + "/log")
            os.mkdir(directory + "/port")
            self.fails(directory, 1, ["--port", "is not a serial port"], "--port", directory + "/port", *rest)
            with emu.directory() as other, Guard(other, e.path, rig(guard.MPC)):
                self.fails(directory, 1, [e.path, "is in use by dryrig-guard"], "--port", e.path, *rest)

    def test_a_path_that_is_taken(self):
        with emu.directory() as directory, emu.Emulator("mpc") as e, emu.Emulator("mpc") as second:
            with Guard(directory, e.path, rig(guard.MPC)) as g:
                free = directory + "/free"
                base = ("--port", second.path, "--config", g.config)
                self.fails(directory, 1, ["--control", "another program has it"], *base, "--link", free, "--control", g.socket,
                           "--log", directory + "/log2")
                self.fails(directory, 1, ["--link", "is in use by another program"], *base, "--link", g.link, "--control", free)
                self.fails(directory, 1, ["is no socket; it stays"], *base, "--link", free, "--control", g.log)
                self.fails(directory, 1, ["it stays"], *base, "--link", g.log, "--control", free)
                self.fails(directory, 1, ["No such file"], *base, "--link", free, "--control", directory + "/none/ctl")
                self.fails(directory, 1, ["No such file"], *base, "--link", free, "--log", directory + "/none/log")
                self.fails(directory, 1, [": is no file"], *base, "--link", free, "--log", "/dev/null")
                with emu.Emulator("mpc", "--record", directory + "/rec") as _:
                    with open(directory + "/rec", encoding="ascii") as recorded:
                        before = recorded.read()
                    self.fails(directory, 1, ["another program records at"], *base, "--link", free, "--record", directory + "/rec")
                    with open(directory + "/rec", encoding="ascii") as recorded:
                        self.assertEqual(recorded.read(), before)
                self.fails(directory, 1, ["another guard keeps its log there"], *base, "--link", free, "--log", g.log)
                self.fails(directory, 1, ["1 to 107 characters"], *base, "--control", directory + "/" + "x" * 200)
                self.assertEqual(g.status()["state"], "disarmed")

    def test_one_file_in_two_roles(self):
        """The log would be appended to the configuration, the recording written over it: told before anything is opened."""
        with emu.directory() as directory:
            conf = config_file(directory)
            with open(conf, "ab"), open(directory + "/rig.log", "wb"):
                pass
            os.link(conf, directory + "/hard")
            os.symlink("rig.conf", directory + "/soft")
            os.symlink("new", directory + "/soft-new") # leads to nothing yet
            os.symlink(directory, directory + "/here")
            os.symlink("/dev/pts/4000000", directory + "/stale") # as a guard that was killed leaves its link
            base = ("--port", "/dev/null", "--config", conf)
            rest = {"--link": directory + "/host", "--control": directory + "/ctl", "--log": directory + "/log",
                    "--record": directory + "/rec"}
            for option in rest:
                for same in ("rig.conf", "./rig.conf", "hard", "soft", "here/rig.conf", "here/../" + os.path.basename(directory) + "/rig.conf"):
                    if option in ("--link", "--control") and same in ("hard", "soft"):
                        continue # a name of its own, which is taken: told as well, later
                    path = directory + "/" + same
                    self.fails(directory, 2, [f"--config {conf} and {option} {path} are the same file"], *base, option, path)
                for other in rest:
                    for path, same in (("new", "new"), ("new", "./new"), ("new", "here/new"), ("stale", "stale")):
                        if option < other:
                            self.fails(directory, 2, ["are the same file"], *base, option, f"{directory}/{path}", other, f"{directory}/{same}")
            for one, other in (("soft-new", "new"), ("new", "soft-new"), ("rig.log", "./rig.log")):
                self.fails(directory, 2, ["are the same file"], *base, "--log", f"{directory}/{one}", "--record", f"{directory}/{other}")
            self.fails(directory, 2, ["are the same file"], *base, "--log", f"{directory}/soft-new", "--link", f"{directory}/new")
            self.fails(directory, 2, ["are the same file"], "--config", conf, "--port", f"{directory}/stale", "--link", f"{directory}/stale")
            self.fails(directory, 2, ["are the same file"], *base, "--record", "/dev/null")
            self.fails(directory, 2, ["the log", "--record", "are the same file"], "log", directory + "/rig.log", "--config", conf, "--record",
                       directory + "/here/rig.log")
            self.fails(directory, 2, ["--config", "--record", "are the same file"], "log", directory + "/rig.log", "--config", conf,
                       "--record", directory + "/hard")
            os.link(conf, directory + "/precious")
            for path in ("precious", "soft", "rig.conf"):
                self.fails(directory, 1, ["holds something else than a compiled configuration: it stays"], "compile", conf, "-o",
                           f"{directory}/{path}")
            os.unlink(directory + "/precious")
            with open(directory + "/precious", "w", encoding="ascii") as file:
                file.write("precious")
            self.fails(directory, 1, ["holds something else than a recording: it stays"], "log", directory + "/rig.log", "--config", conf,
                       "--record", directory + "/precious")
            with open(conf, encoding="ascii") as file:
                self.assertEqual(file.read(), rig(guard.MPC))

    def test_no_place_for_the_mark(self):
        with emu.directory() as directory, emu.Emulator("mpc") as e:
            conf = config_file(directory)
            for where, words in (("/none", "No such file or directory"), ("/rig.conf", "Not a directory")):
                done = subprocess.run([guard.PROGRAM, "--port", e.path, "--config", conf], capture_output=True, check=False,
                                      env={**os.environ, "DRYRIG_LOCK_DIR": directory + where}, timeout=emu.LIMIT_S)
                self.assertEqual((done.returncode, done.stdout), (1, b""))
                self.assertIn(words, done.stderr.decode())
                self.assertIn("DRYRIG_LOCK_DIR names another directory", done.stderr.decode())
            with emu.directory() as other, Guard(other, other + "/later", rig(guard.MPC), wait="locked"):
                done = subprocess.run([guard.PROGRAM, "--port", "later", "--config", conf], capture_output=True, check=False, cwd=other,
                                      env={**os.environ, "DRYRIG_LOCK_DIR": other}, timeout=emu.LIMIT_S)
                self.assertEqual((done.returncode, done.stdout), (1, b""))
                self.assertIn(f"{other}/later is in use by another guard\n", done.stderr.decode())

    def test_a_stdout_that_is_full(self):
        with emu.directory() as directory, emu.Emulator("mpc") as e, open("/dev/full", "wb") as full:
            conf = config_file(directory)
            done = subprocess.run([guard.PROGRAM, "--port", e.path, "--config", conf, "--link", directory + "/host", "--control",
                                   directory + "/ctl"], stdout=full, stderr=subprocess.PIPE, timeout=emu.LIMIT_S, check=False)
            self.assertEqual(done.returncode, 1)
            self.assertEqual(os.listdir(directory), ["rig.conf"])


class Ending(realtime.TestCase):
    def test_nothing_is_left_behind(self):
        for how in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGUSR1, signal.SIGUSR2, signal.SIGALRM):
            with emu.directory() as directory, emu.Emulator("mpc") as e:
                with Guard(directory, e.path, rig(guard.MPC)) as g:
                    self.assertEqual(stat.S_IMODE(os.stat(g.socket).st_mode), 0o600)
                    self.assertEqual(os.readlink(g.link), g.path)
                    self.assertEqual(g.stop(how), 0)
                self.assertEqual(sorted(os.listdir(directory)), ["log", "rig.conf", "stderr"])


    def test_a_frame_that_has_been_begun_is_finished(self):
        with emu.directory() as directory, emu.Emulator("mpc") as e:
            with Guard(directory, e.path, rig(guard.MPC)) as g, emu.Port(g.path) as port:
                g.arm()
                port.send(line(0, 2000, 0, 0))
                g.wait_for("moving") # its first bytes are on the wire
                self.assertEqual(g.stop(), 0)
            with emu.Port(e.path) as port: # at rest, and it listens
                self.assertLess(position_mpc(port.ask(b"C", 14))[0], 100)


class Telling(realtime.TestCase):
    def test_check(self):
        with emu.directory() as directory:
            status, out, err = guard.run("check", config_file(directory, rig(guard.TRIO, keepouts=guard.POST, margin=50)))
            self.assertEqual((status, err), (0, ""))
            for words in ("TRIO MP-245A, firmware 3.12", "hash          ", "room          ", '"post", drive 1: X 2,000.0 to 3,000.0 um',
                          "S  line         checked, while armed\n", "h  home         refused: ", "R  recalibrate  refused: "):
                self.assertIn(words, out)

    def test_the_hash_names_the_content(self):
        with emu.directory() as directory:
            texts = [rig(guard.MPC), rig(guard.MPC) + "# a remark", rig(guard.MPC, margin=1)]
            hashes = [next(row for row in guard.run("check", config_file(directory, text))[1].splitlines() if "hash" in row)
                      for text in texts]
            self.assertEqual(hashes[0], hashes[1])
            self.assertNotEqual(hashes[0], hashes[2])

    def test_explain(self):
        with emu.directory() as directory:
            conf = config_file(directory, rig(guard.MPC, keepouts=guard.POST, high=20000))
            for status, words, *args in (
                    (0, ["allowed", "from a forbidden place (", "post", "'escape on'"], "--from", "2100,2500,100", "line 1500 2500 100 speed 3"),
                    (0, ["allowed", "straight within"], "--from", "0,0,0", "line 4000 100 0 speed 15"),
                    (4, ["refused (keep-out)", "post"], "--from", "0,0,0", "line 4000 4000 0 speed 15"),
                    (4, ["refused (limit)", "20,001.0 um", "20,000.0 um"], "--from", "0,0,0", "move 20001 0 0"),
                    (4, ["refused (range)"], "--from", "0,0,0", "move -1 0 0"),
                    (4, ["refused (level)"], "--from", "0,0,0", "line 1 1 1 speed 16"),
                    (4, ["refused (hidden)"], "--from", "0,0,0", "home"),
                    (4, ["refused (drive-value)"], "select 2"),
                    (0, ["allowed"], "select 1"),
                    (0, ["allowed"], "position"),
                    (4, ["refused (stream)"], "stream-on")):
                code, out, err = guard.run("explain", conf, *args)
                self.assertEqual((args, code, err), (args, status, ""))
                for word in words:
                    self.assertIn(word, out)
            for words, *args in ((["no such command", "line", "move"], "--from", "0,0,0", "fly 1 2 3"),
                                 (["where from?"], "move 1 2 3"),
                                 (["where from?"], "--from", "1,2", "move 1 2 3"),
                                 (["where from?"], "--from", "nan,2,3", "move 1 2 3"),
                                 (["a coordinate is missing"], "--from", "1,2,3", "move 1 2"),
                                 (["is no number"], "--from", "1,2,3", "move 1 2 0x10"),
                                 (["is no number"], "--from", "1,2,3", "move 1 2 1e3"),
                                 (["a whole number"], "--from", "1,2,3", "line 1 2 3 speed 8.5"),
                                 (["something behind"], "--from", "1,2,3", "move 1 2 3 4"),
                                 (["'speed' and its level"], "--from", "1,2,3", "line 1 2 3"),
                                 (["drive 2 is not in the configuration"], "--drive", "2", "--from", "1,2,3", "move 1 2 3")):
                code, out, err = guard.run("explain", conf, *args)
                self.assertEqual((args, code, out), (args, 2, ""))
                for word in words:
                    self.assertIn(word, err)


class Compiling(realtime.TestCase):
    def test_a_binary_is_what_the_text_is(self):
        with emu.directory() as directory:
            conf, binary = config_file(directory, rig(guard.TRIO, keepouts=guard.POST)), directory + "/rig.bin"
            status, out, err = guard.run("compile", conf, "-o", binary)
            self.assertEqual((status, err), (0, ""))
            told = re.fullmatch(rf"{binary}: (\d+) bytes, revision 1, hash ([0-9A-F]{{8}})\n", out)
            self.assertEqual(os.stat(binary).st_size, int(told[1]))
            self.assertEqual(sorted(os.listdir(directory)), ["rig.bin", "rig.conf"])
            for path in (conf, binary):
                self.assertIn(told[2], guard.run("check", path)[1])
            motion = ("--from", "0,2500,100", "line 4000 2500 100 speed 15")
            self.assertEqual([guard.run("explain", path, *motion)[0] for path in (conf, binary)], [4, 4])
            with open(binary, "r+b") as file:
                file.seek(100)
                file.write(b"\xff")
            status, out, err = guard.run("check", binary)
            self.assertEqual((status, out), (3, ""))
            self.assertIn(f"{binary}: a compiled configuration that is damaged", err)

    def test_what_is_wrong(self):
        with emu.directory() as directory:
            conf, binary = config_file(directory), directory + "/rig.bin"
            for status, words, *args in ((2, "expected a configuration and --output", conf), (2, "given twice", conf, "-o", "a", "-o", "b"),
                                         (3, "No such file", conf + "x", "-o", binary), (1, "is no file", conf, "-o", "/dev/null")):
                code, out, err = guard.run("compile", *args)
                self.assertEqual((args, code, out), (args, status, ""))
                self.assertIn(words, err)
            self.assertEqual(guard.run("compile", conf, "-o", binary)[0], 0)
            conf = config_file(directory, rig(guard.MPC, margin=1))
            status, out, err = guard.run("compile", conf, "--output", binary)
            self.assertEqual((status, out), (4, ""))
            self.assertIn("needs a higher 'revision' than 1", err)


class Killed(realtime.TestCase):
    """kill -9 in mid-move, of each, in every order of starting again: locked or disarmed, and nothing moves by itself."""

    def setUp(self):
        stack = emu.contextlib.ExitStack()
        self.addCleanup(stack.close)
        self.directory = stack.enter_context(emu.directory())
        self.device_link = self.directory + "/emu"
        self.emulator = emu.Emulator("mpc", "--link", self.device_link)
        self.addCleanup(lambda: self.emulator.stop(signal.SIGKILL))
        self.guard = Guard(self.directory, self.device_link, rig(guard.MPC))
        self.addCleanup(lambda: self.guard.stop(signal.SIGKILL))
        self.start_host()
        self.addCleanup(self.kill_host)

    def start_host(self):
        """A host of its own, so that it can be killed: it writes what it is given, until then."""
        self.host = subprocess.Popen(["/bin/sh", "-c", 'exec cat >"$0"', self.guard.link], stdin=subprocess.PIPE)
        emu.wait_until(lambda: self.guard.status()["host_open"], "the host")

    def kill_host(self):
        self.host.kill()
        self.host.wait()
        self.host.stdin.close()

    def start_move(self):
        self.guard.arm()
        self.host.stdin.write(line(0, 2000, 0, 0))
        self.host.stdin.flush()
        self.guard.wait_for("moving")
        emu.wait_until(lambda: not self.guard.status()["within_frame"], "the frame to leave: it has a pause of 35 ms within")
        guard.pause(0.2) # its last bytes are off the line, as far as the guard may know

    def restart_device(self):
        self.emulator = emu.Emulator("mpc", "--link", self.device_link)

    def nothing_moves(self):
        self.guard.wait_for("disarmed")
        with emu.Port(self.guard.path) as port:
            first = position_mpc(port.ask(b"C", 14))
            guard.pause(0.1)
            self.assertEqual(position_mpc(port.ask(b"C", 14)), first)
        self.assertLess(first[0], 1900)
        self.assertEqual(self.guard.status()["fault"], "none")

    def test_the_guard(self):
        self.start_move()
        self.guard.kill()
        self.assertTrue(os.path.islink(self.guard.link)) # left over
        self.guard.start()
        self.nothing_moves()
        self.assertEqual(self.guard.status()["disarmed_says"], "the guard before did not end in order")
        self.assertIn("disarmed: the guard before did not end in order", self.guard.err())
        with open(self.guard.log, encoding="utf-8") as file:
            self.assertIn("^C: the guard was not stopped in order before", file.read())
        self.assertEqual(guard.run("log", self.guard.log)[0], 0)
        self.guard.arm()

    def test_the_guard_in_a_move_that_cannot_be_stopped(self):
        """^C does not stop H of a TRIO [T note 12]: it ends at its target, and the next guard waits for that."""
        with emu.directory() as directory, emu.Emulator("trio") as e:
            with Guard(directory, e.path, rig(guard.TRIO)) as g, emu.Port(g.path) as port:
                g.arm()
                port.send(b"H" + emu.point(100000, 10667, 10667)) # 8.4 mm along X
                g.wait_for("moving-unstoppable")
                emu.wait_until(lambda: not g.status()["within_frame"], "the frame to leave")
                guard.pause(0.1)
                g.kill()
                g.start()
                with emu.Port(g.path) as again:
                    self.assertEqual(again.ask(b"C", 14)[:12], emu.point(100000, 10667, 10667))
                self.assertEqual((g.status()["state"], g.status()["fault"]), ("disarmed", "none"))
                self.assertIn("the last guard was not stopped in order", self.last_start(g))

    @staticmethod
    def last_start(g):
        with open(g.log, encoding="utf-8") as file:
            return [line for line in file if " start " in line][-1]

    def test_the_guard_within_a_frame(self):
        """The controller waits for the rest of the frame, and a person has to switch it off and on."""
        self.guard.arm()
        self.host.stdin.write(line(0, 2000, 0, 0))
        self.host.stdin.flush()
        self.guard.wait_for("moving")
        self.guard.kill()
        self.assertEqual(self.mark(), "1")
        self.guard.start("locked")
        for how in (signal.SIGTERM, signal.SIGKILL, None): # each start knows of it, and nothing that anybody does is sent
            status = self.guard.status()
            self.assertEqual((status["fault"], status["next"], status["confirm_wanted"]), ("torn-frame", "confirm", True))
            self.assertIn("switch it off and on, then 'confirm'", status["fault_says"])
            self.kill_host()
            self.start_host()
            self.host.stdin.write(b"\x03C" * 15)
            self.host.stdin.flush()
            self.guard.order("stop")
            self.assertIn("see fault and needs", self.guard.order("clear")["why"])
            self.assertFalse(self.guard.order("arm")["ok"])
            if how is not None:
                self.guard.stop(how)
                self.assertEqual(self.mark(), "1")
                self.guard.start("locked")
        self.assertIn("switch it off and on, then 'confirm'", self.guard.err())
        self.emulator.stop(signal.SIGKILL)
        self.restart_device()
        guard.pause(0.6) # for the guard to find the port
        self.assertEqual(self.guard.status()["fault"], "torn-frame")
        self.assertEqual(self.guard.order("confirm")["ok"], True)
        self.nothing_moves()
        emu.wait_until(lambda: self.mark() == "0", "the mark to go")
        self.guard.arm()

    def test_the_guard_within_a_frame_is_known_by_every_name_of_its_port(self):
        """As /dev/serial/by-id/... is a link to /dev/ttyUSB0, and to /dev/ttyUSB1 when it was plugged in again. A name that only
        the guard before knew wants its own 'confirm': it may be another controller's by now."""
        os.mkdir(self.directory + "/by-id")
        names = {name: f"{self.directory}/{name}" for name in ("ttyUSB0", "ttyUSB1", "by-id/converter")}

        def plug(number):
            for name in names.values():
                if os.path.islink(name):
                    os.unlink(name)
            if number is not None:
                os.symlink(self.emulator.path, names[f"ttyUSB{number}"])
                os.symlink(f"../ttyUSB{number}", names["by-id/converter"])

        def starts(name, state, fault):
            self.guard.args[self.guard.args.index("--port") + 1] = names[name]
            self.guard.start(state)
            self.assertEqual(self.guard.status()["fault"], fault)

        def is_killed_within_a_frame():
            self.kill_host()
            self.start_host()
            self.guard.arm()
            self.host.stdin.write(line(0, 2000, 0, 0))
            self.host.stdin.flush()
            self.guard.wait_for("moving")
            self.guard.kill()

        def is_mended(number=0):
            self.emulator.stop(signal.SIGKILL)
            self.guard.wait_for("locked")
            self.restart_device()
            plug(number)
            emu.wait_until(lambda: "device_says" not in self.guard.status(), "the port")
            self.guard.order("confirm")
            self.guard.wait_for("disarmed")
            self.guard.stop()

        def marks():
            return {name: content for name in names for content in self.marks(name.replace("/", "."))}

        self.guard.stop()
        plug(0)
        by_id, device = "by-id/converter", "ttyUSB0"
        for killed_as, started_as, number, left in ((by_id, device, 0, {by_id: "1"}), (device, by_id, 0, {}), (by_id, by_id, 1, {device: "1"})):
            starts(killed_as, "disarmed", "none")
            is_killed_within_a_frame()
            plug(number)
            starts(started_as, "locked", "torn-frame")
            is_mended(number)
            self.assertEqual(marks(), left)
            plug(0)
            for name in left:
                starts(name, "locked", "torn-frame")
                is_mended()
            self.assertEqual(marks(), {})

        starts(device, "disarmed", "none")  # a guard that was started before there was anything to be known of
        is_killed_within_a_frame()
        plug(None)
        starts(by_id, "locked", "no-device")
        plug(0)
        emu.wait_until(lambda: "whose last guard was killed within a command" in self.guard.status().get("device_says", ""), "the words")
        self.assertEqual(self.guard.status()["fault"], "no-device")
        self.assertEqual(self.guard.err().count("whose last guard was killed within a command"), 1)
        self.guard.stop()
        starts(by_id, "locked", "torn-frame")
        is_mended()
        self.assertEqual(marks(), {})

    def marks(self, port):
        """What is noted of a port."""
        path = f"{self.directory}/dryrig-guard{self.directory.replace('/', '.')}.{port}"
        if os.path.exists(path):
            with open(path, encoding="ascii") as file:
                yield file.read()

    def mark(self):
        name, = (name for name in os.listdir(self.directory) if name.startswith("dryrig-guard."))
        self.assertEqual(stat.S_IMODE(os.stat(self.directory + "/" + name).st_mode), 0o666) # for another user's guard
        with open(self.directory + "/" + name, encoding="ascii") as file:
            return file.read()

    def test_the_guard_while_the_controller_does_not_answer(self):
        """It may wait for the rest of an S that nobody remembers: the bytes of many guards must not become it."""
        with emu.directory() as directory, emu.Emulator("mpc", "--device", "none") as e:
            with Guard(directory, e.path, rig(guard.MPC), wait="locked") as g:
                emu.wait_until(lambda: g.status()["fault"] == "device-silent", "the query")
                g.kill()
                g.start("locked")
                self.assertEqual(g.status()["fault"], "torn-frame")
                g.order("confirm")
                emu.wait_until(lambda: g.status()["fault"] == "device-silent", "the query")

    def test_the_host(self):
        self.start_move()
        self.kill_host()
        self.nothing_moves()

    def test_the_device(self):
        self.start_move()
        self.emulator.stop(signal.SIGKILL)
        self.guard.wait_for("locked")
        self.assertEqual(self.guard.status()["fault"], "no-device")
        self.assertIn("gone", self.guard.status()["device_says"])
        self.restart_device()
        self.nothing_moves()

    def test_the_guard_and_the_device_in_both_orders(self):
        for device_first in (True, False):
            with self.subTest(device_first=device_first):
                self.start_move()
                self.guard.kill()
                self.emulator.stop(signal.SIGKILL)
                os.unlink(self.device_link) # its /dev/pts/N may be another test's by now
                if device_first:
                    self.restart_device()
                    self.guard.start()
                else:
                    self.guard.start("locked")
                    self.assertIn(self.device_link, self.guard.status()["device_says"])
                    self.restart_device()
                self.nothing_moves()
                self.kill_host()
                self.start_host()

    def test_the_guard_and_the_host_in_both_orders(self):
        for host_first in (True, False):
            with self.subTest(host_first=host_first):
                self.start_move()
                if host_first:
                    self.kill_host()
                    self.guard.kill()
                else:
                    self.guard.kill()
                    self.kill_host()
                self.guard.start()
                self.nothing_moves()
                self.start_host()

    def test_the_host_and_the_device_in_both_orders(self):
        for host_first in (True, False):
            with self.subTest(host_first=host_first):
                self.start_move()
                self.emulator.stop(signal.SIGKILL)
                self.kill_host()
                if host_first:
                    self.start_host()
                    self.restart_device()
                else:
                    self.restart_device()
                    self.start_host()
                self.nothing_moves()

    def test_a_controller_of_the_other_kind_comes_back(self):
        self.emulator.stop(signal.SIGKILL)
        self.guard.wait_for("locked")
        self.emulator = emu.Emulator("trio", "--link", self.device_link)
        emu.wait_until(lambda: self.guard.status()["fault"] in ("identity", "device-silent", "implausible"), "the refusal")
        self.assertEqual(self.guard.status()["state"], "locked")


if __name__ == "__main__":
    guard.main()
