"""dryrig and the examples, against dryrig-emu on PTYs: every command of both controllers, errors, signals, ports."""
import json
import os
import pty
import re
import select
import signal
import subprocess
import tempfile
import time
import unittest

import realtime

DRYRIG = os.environ["DRYRIG"]
EMULATOR = os.environ["DRYRIG_EMU"]
EXAMPLES = os.environ["DRYRIG_EXAMPLES"]
SHIM = os.environ["DRYRIG_SHIM"]
LIMIT_S = 60  # that only a broken program reaches


def run(*args, env=None, program=DRYRIG):
    done = subprocess.run([program, *args], stdin=subprocess.DEVNULL, capture_output=True, timeout=LIMIT_S * 3,
                          env={**os.environ, **(env or {})})
    return done.returncode, done.stdout.decode(), done.stderr.decode()


class Rig:
    """An emulator, and dryrig's options for it. Its lint has nothing to say, but for what is done wrong on purpose: `breaks`."""

    def __init__(self, kind, stage, *args):
        self.folder = tempfile.TemporaryDirectory()
        self.trace = f"{self.folder.name}/trace"
        self.lint = f"{self.folder.name}/lint"
        self.breaks = set()  # rules, by name
        self.process = subprocess.Popen([EMULATOR, kind, "--device", stage, "--trace", self.trace, "--lint-json", self.lint, *args],
                                        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.path = self.process.stdout.readline().removeprefix("ready ").strip()
        self.options = ["--port", self.path, "--controller", kind, "--stage", stage]

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        findings = self.stop()
        if kind is None and {finding["name"] for finding in findings} != self.breaks:
            raise AssertionError(f"{findings}, not {self.breaks}")

    def stop(self):
        self.process.terminate()
        self.process.communicate(timeout=LIMIT_S)
        with open(self.lint, encoding="utf-8") as file:
            findings = json.load(file)["findings"]
        self.folder.cleanup()
        return findings

    def wait_for_request(self, code):
        """Until the emulator has got a command that begins with this byte."""
        deadline = time.monotonic() + LIMIT_S
        while time.monotonic() < deadline:
            with open(self.trace, encoding="utf-8") as trace:
                if any(re.match(rf" *[0-9.]+ > {code:02X}", line) for line in trace):
                    return
            time.sleep(0.02)
        raise AssertionError("no such command came")

    def run(self, *args, expect=0):
        status, out, err = run(*self.options, *args)
        if status != expect:
            raise AssertionError(f"{args}: exit status {status}, not {expect}; {out} {err}")
        return out if expect == 0 else out + err

    def json(self, *args, expect=0):
        return [json.loads(line) for line in self.run("--json", *args, expect=expect).splitlines() if line[0] == "{"]

    def steps(self):
        return self.json("position")[-1]["position"]["steps"]


class Commands(realtime.TestCase):
    def test_every_command_of_the_mpc(self):
        with Rig("mpc", "MP-225", "--device", "MP-285", "--speedup", "50", "--work", "0,0,16000") as rig:
            info = rig.json("info")[-1]
            self.assertEqual(("mpc", "3.21", 1, 2, [1, 2]),
                             tuple(info[key] for key in ("controller", "firmware", "drive", "drives", "connected")))
            self.assertEqual("x 100.000  y 200.000  z 300.000 um  drive 1\n", rig.run("move", "100", "200", "300"))
            self.assertEqual([1600, 3200, 4800], rig.steps())
            self.assertEqual("x 0  y 0  z 16 steps  drive 1\n", rig.run("--steps", "move", "0", "0", "16"))
            rig.run("axis", "y", "12.5")
            rig.run("line", "50", "60", "70", "--speed", "9")
            rows = rig.json("line", "40", "60", "70", "--speed", "15", "--stream")
            self.assertTrue(rows[-1]["ok"])
            self.assertGreater(len(rows), 2)
            self.assertTrue(all(640 <= row["streamed"]["steps"][0] < 800 for row in rows[:-1]))
            rig.run("home")
            self.assertEqual("x 0.000  y 0.000  z 1000.000 um  drive 1\n", rig.run("work"))
            self.assertIn("stood still", rig.run("work", expect=1))
            rig.breaks = {"work-without-home"}
            rig.run("calibrate")
            rig.run("mode", "3")
            rig.run("select", "2")
            self.assertEqual("x 0.000  y 0.000  z 0.000 um  drive 2\n", rig.run("position"))
            self.assertIn("drive 3", rig.run("select", "3", expect=1))
            rig.run("stop")
            for words in (["angle", "30"], ["select", "5"], ["mode", "10"], ["line", "1", "1", "1", "--speed", "16"]):
                rig.run(*words, expect=2)

    def test_every_command_of_the_trio(self):
        with Rig("trio", "MP-845", "--speedup", "50", "--work", "5000,6000,7000") as rig:
            info = rig.json("info")[-1]
            self.assertEqual(("trio", "3.12", False), (info["controller"], info["firmware"], info["firmware_asked"]))
            self.assertEqual(0.09375, info["stage"]["um_per_step"])
            rig.run("move", "1500", "750", "1125")
            self.assertEqual([16000, 8000, 12000], rig.steps())
            rig.run("move", "--order", "work", "1500", "750", "375")
            rig.run("move", "1500", "750", "750", "--order=home")
            rig.run("line", "750", "750", "750", "--speed", "15")
            rig.run("axis", "X", "93.75")
            self.assertEqual([1000, 8000, 8000], rig.steps())
            rig.run("angle", "45")
            self.assertIn("angle 45 degrees", rig.run("position"))
            self.assertEqual("x 0  y 0  z 0 steps  angle 45 degrees\n", rig.run("home", "--steps"))
            self.assertEqual("x 5000  y 6000  z 7000 steps  angle 45 degrees\n", rig.run("work", "--steps"))
            rig.run("calibrate")
            rig.run("stop")
            for words in (["angle", "91"], ["select", "1"], ["mode", "1"],
                          ["line", "1", "1", "1", "--speed", "3", "--stream"]):
                rig.run(*words, expect=2)

    def test_refused_targets(self):
        with Rig("mpc", "MP-265") as rig:
            self.assertIn("-5 um is outside", rig.run("move", "-5", "0", "0", expect=2))
            self.assertIn("-0.5 um is outside", rig.run("axis", "z", "-.5", expect=2))
            self.assertIn("-1 steps", rig.run("--steps", "move", "0", "0", "-1", expect=2))
            self.assertIn("0 to 12500 um", rig.run("move", "0", "12500.1", "0", expect=2))
            row = rig.json("move", "-5", "0", "0", expect=2)[-1]
            self.assertEqual((False, "range", "caller"), (row["ok"], row["error"], row["fault"]))
            self.assertEqual([0, 0, 0], rig.steps())

    def test_options_before_and_after_the_command(self):
        with Rig("mpc", "MP-225", "--speedup", "50") as rig:
            for words in (["move", "1", "2", "3", *rig.options], [*rig.options, "move", "1", "2", "3"],
                          ["move", *rig.options[:2], "1", "2", *rig.options[2:], "3"],
                          ["-p", rig.path, "-cMPC", "move", "-smp225/m", "1", "--", "2", "3"]):
                self.assertEqual(0, run(*words)[0], words)
            status, _, err = run(*rig.options, "move", "--", "-1", "2", "3")
            self.assertEqual((2, True), (status, "outside" in err))
            status, out, _ = run("-c", "mpc", "--steps", "position", env={"DRYRIG_PORT": rig.path})
            self.assertEqual((0, "x 16  y 32  z 48 steps  drive 1\n"), (status, out))

    def test_old_firmware_and_an_empty_controller(self):
        with Rig("mpc", "MP-225", "--firmware", "1.03", "--speedup", "50") as rig:
            self.assertIn("below 3.00", rig.run("info"))
            rig.run("move", "10", "20", "30")
            rig.run("line", "1", "2", "3", "--speed", "4", expect=2)
            self.assertIn("firmware", rig.run("calibrate", expect=2))
        with Rig("mpc", "none") as empty:
            status, _, err = run("-p", empty.path, "-c", "mpc", "--steps", "position")
            self.assertEqual((1, True), (status, "manipulator" in err))

    def test_observed_quirks(self):
        quirks = "observed,position-13,stop-says-i,nul-heartbeat"
        with Rig("mpc", "MP-225", "--quirks", quirks, "--position", "320,0,0") as rig:
            rig.run("--steps", "move", "2000", "2000", "2000")
            rig.breaks = {"small-move"}
            self.assertIn("under 16 steps", rig.run("--steps", "move", "2015", "2000", "2000", expect=1))
            rig.run("--steps", "line", "1000", "0", "7", "--speed", "15")
            rig.run("home")
            rig.run("stop")


class Usage(unittest.TestCase):
    def test_errors_say_what_and_where(self):
        for words, said in (([], "no command"), (["fly"], "no command 'fly'"), (["position"], "--controller"),
                            (["-c", "mpc", "-s", "MP-225", "position"], "--port"),
                            (["-c", "sutter", "position"], "trio or mpc"),
                            (["-c", "mpc", "-p", "x", "position"], "MP-865"), # microns need a stage; lists them
                            (["-c", "trio", "-p", "x", "-s", "MP-225", "position"], "MP-845"),
                            (["-c", "mpc", "-p", "x", "-s", "MP-225", "move", "1", "2"], "X Y Z"),
                            (["-c", "mpc", "-p", "x", "-s", "MP-225", "move", "1", "2", "3", "4"], "too many"),
                            (["-c", "mpc", "-p", "x", "-s", "MP-225", "move", "1", "2", "z"], "'z'"),
                            (["-c", "mpc", "-p", "x", "-s", "MP-225", "move", "1", "2", "nan"], "'nan'"),
                            (["-c", "mpc", "-p", "x", "--steps", "move", "1", "2", "1.5"], "whole number"),
                            (["-c", "mpc", "-p", "x", "--steps", "move", "1", "2", "99999999999"], "whole number"),
                            (["-c", "mpc", "-p", "x", "-s", "MP-225", "axis", "w", "1"], "x, y, z"),
                            (["-c", "mpc", "-p", "x", "-s", "MP-225", "line", "1", "2", "3"], "--speed"),
                            (["-c", "mpc", "-p", "x", "-s", "MP-225", "home", "--speed", "3"], "'line'"),
                            (["-c", "mpc", "-p", "x", "--steps", "move", "1", "2", "3", "--order", "up"], "or work"),
                            (["-c", "mpc", "-p", "x", "--firmware", "3.2", "home"], "3.21"),
                            (["-c", "mpc", "-p", "x", "--baud", "0", "home"], "--baud"),
                            (["--wrong"], "--wrong")):
            status, out, err = run(*words, env={"DRYRIG_PORT": ""} if "--port" != said else None)
            self.assertEqual((2, "", True), (status, out, said in err), (words, err))

    def test_help_and_version(self):
        status, out, err = run("--help")
        self.assertEqual((0, ""), (status, err))
        commands = re.findall(r"^  ([a-z]+)[ \n]", out.split("Options")[0], re.M)
        self.assertEqual(14, len(commands))
        for command in commands:
            status, text, _ = run(command, "--help")
            self.assertEqual((0, True), (status, f"[OPTIONS] {command}" in text))
        self.assertRegex(run("--version")[1], r"^dryrig \d+\.\d+\.\d+\n$")
        self.assertTrue(all(len(line) <= 120 for line in out.splitlines() if not line.startswith("Stages")))


class Starting(realtime.TestCase):
    def start(self, words, **options):
        process = subprocess.Popen(words, **options)

        def end():
            process.kill()
            process.communicate()

        self.addCleanup(end)
        return process


class Ports(Starting):
    def test_a_missing_port_lists_those_that_there_are(self):
        with tempfile.TemporaryDirectory() as folder:
            status, _, err = run("-p", f"{folder}/none", "-c", "mpc", "--steps", "position")
            self.assertEqual((1, True, True), (status, "no such port" in err, "serial ports" in err))
            os.symlink("/dev/pts/none", f"{folder}/stale")
            status, _, err = run("-p", f"{folder}/stale", "-c", "mpc", "--steps", "position")
            self.assertEqual((1, True), (status, "gone" in err))
            status, _, err = run("-p", folder, "-c", "mpc", "--steps", "position")
            self.assertEqual((1, True), (status, "not a serial port" in err))
        status, out, _ = run("ports", "--json")
        self.assertEqual((0, True), (status, isinstance(json.loads(out)["ports"], list)))
        self.assertEqual(0, run("ports")[0])

    def check_busy(self, options, env):
        env = {**os.environ, **env}
        holder = self.start([DRYRIG, *options, "--json", "line", "20000", "0", "0", "--speed", "0", "--stream"],
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=env)
        holder.stdout.readline()  # it has the port, and moves
        status, _, err = run(*options, "position", env=env)
        self.assertEqual((1, True), (status, f"dryrig (process {holder.pid})" in err), err)
        holder.send_signal(signal.SIGINT)
        _, err = holder.communicate(timeout=LIMIT_S)
        self.assertEqual(130, holder.returncode, err)
        status, _, err = run(*options, "position", env=env)
        self.assertEqual(0, status, err)  # free again
        holder = self.start([DRYRIG, *options, "--json", "line", "0", "0", "0", "--speed", "0", "--stream"],
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=env)
        holder.stdout.readline()
        holder.kill()  # no chance to clean up
        holder.communicate(timeout=LIMIT_S)
        status, _, err = run(*options, "stop", env=env)  # free all the same; and what it began is stopped
        self.assertEqual(0, status, err)

    def test_a_busy_port_names_who_has_it(self):
        with Rig("mpc", "MP-225") as rig:
            rig.breaks = {"unread-reply"}  # one is killed while it moves
            self.check_busy(rig.options, {})

    def test_a_link_and_a_port_that_ends(self):
        with tempfile.TemporaryDirectory() as folder:
            rig = Rig("mpc", "MP-225", "--link", f"{folder}/mpc")
            self.assertEqual(0, run("-p", f"{folder}/mpc", "-c", "mpc", "--steps", "position")[0])
            mover = self.start([DRYRIG, *rig.options, "--json", "line", "5000", "0", "0", "--speed", "0", "--stream"],
                                     stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            mover.stdout.readline()  # it moves
            rig.stop()
            out, err = mover.communicate(timeout=LIMIT_S)
            self.assertEqual(1, mover.returncode, err)
            self.assertEqual("link", json.loads(out.decode().splitlines()[-1])["error"])

    def test_libserialport_end_to_end(self):
        """The code for serial ports, on a PTY that looks like one (serial_shim.c)."""
        for kind, stage in (("mpc", "MP-225"), ("trio", "MP-845")):
            with Rig(kind, stage, "--speedup", "50") as rig:
                asan = os.environ.get("ASAN_OPTIONS", "")
                env = {"LD_PRELOAD": SHIM, "DRYRIG_SHIM_PTY": rig.path,
                       "ASAN_OPTIONS": f"{asan}:verify_asan_link_order=0"}
                options = ["-p", "/dev/ttyEMU0", "-c", kind, "-s", stage]
                self.assertEqual(1, run(*options, "position")[0])  # without the shim there is no such port
                for words in (["info"], ["move", "300", "300", "300"], ["line", "150", "300", "300", "--speed", "15"],
                              ["home"], ["calibrate"], ["stop"]):
                    status, out, err = run(*options, *words, env=env)
                    self.assertEqual((0, ""), (status, err), words)
        with Rig("mpc", "MP-225") as rig:
            rig.breaks = {"unread-reply"}  # one is killed while it moves
            self.check_busy(["-p", "/dev/ttyEMU0", "-c", "mpc", "-s", "MP-225"], {**env, "DRYRIG_SHIM_PTY": rig.path})


class Signals(Starting):
    def stop_a_line(self, rig, *args, how=signal.SIGINT, ignored=False):
        def ignore():
            signal.signal(signal.SIGINT, signal.SIG_IGN if ignored else signal.SIG_DFL)

        mover = self.start([DRYRIG, *rig.options, "--json", *args], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                 preexec_fn=ignore)
        if "--stream" in args:
            mover.stdout.readline()  # it moves
        else:
            rig.wait_for_request(ord("S"))
        mover.send_signal(how)
        out, err = mover.communicate(timeout=LIMIT_S)
        return mover.returncode, json.loads(out.decode().splitlines()[-1]), err.decode()

    def test_sigint_stops_a_stream_and_says_where(self):
        for ignored in (False, True):
            with Rig("mpc", "MP-225") as rig:
                status, row, err = self.stop_a_line(rig, "line", "20000", "0", "0", "--speed", "5", "--stream",
                                                    ignored=ignored)
                self.assertEqual((130, "interrupted"), (status, row["error"]), err)
                self.assertTrue(0 < row["position"]["steps"][0] < 320000)
                self.assertEqual(row["position"]["steps"], rig.steps())

    def test_sigterm_stops_a_trio_line(self):
        with Rig("trio", "MP-845") as rig:
            status, row, err = self.stop_a_line(rig, "line", "20000", "999", "999", "--speed", "0", how=signal.SIGTERM)
            self.assertEqual((143, "interrupted"), (status, row["error"]), err)
            self.assertEqual(row["position"]["steps"], rig.steps())

    def test_a_trio_move_runs_to_its_end(self):
        with Rig("trio", "MP-845") as rig:
            mover = self.start([DRYRIG, *rig.options, "move", "9000", "9000", "9000"], stdout=subprocess.PIPE,
                                     stderr=subprocess.PIPE)
            rig.wait_for_request(ord("W"))
            mover.send_signal(signal.SIGINT)
            out, err = mover.communicate(timeout=LIMIT_S)
            self.assertEqual(130, mover.returncode)
            self.assertIn(b"cannot stop", err)
            self.assertEqual([96000, 96000, 96000], rig.steps())

    def test_progress_on_a_terminal(self):
        with Rig("mpc", "MP-225") as rig:
            parent, child = pty.openpty()
            mover = self.start([DRYRIG, *rig.options, "move", "3000", "0", "0"], stdout=subprocess.DEVNULL,
                               stderr=child)
            os.close(child)
            seen = b""
            while select.select([parent], [], [], LIMIT_S)[0]:
                try:
                    seen += os.read(parent, 4096)
                except OSError:
                    break
            os.close(parent)
            self.assertEqual(0, mover.wait(timeout=LIMIT_S))
            self.assertRegex(seen, rb"\rmove: \d+ %")
            self.assertTrue(seen.endswith(b"\r\x1b[K"))


class Examples(realtime.TestCase):
    def run_example(self, name, *args):
        status, out, err = run(*args, program=f"{EXAMPLES}/example_{name}")
        self.assertEqual(0, status, err)
        return out, err

    def test_each(self):
        with Rig("trio", "MP-845", "--speedup", "20") as rig:
            self.assertEqual("1000.031 1000.031 1000.031 um = 10667 10667 10667 steps\n",
                             self.run_example("where_is_it", rig.path, "trio", "MP-845")[0])
            self.assertIn("1000.031 1000.031 1300.031", self.run_example("move", rig.path, "trio", "MP-845", "300")[0])
        with Rig("mpc", "MP-225", "--device", "MT-800") as rig:
            self.run_example("where_is_it", rig.path, "mpc", "MP-225")
            out, err = self.run_example("line_with_stream", rig.path, "MP-225", "50", "0", "0", "5")
            self.assertEqual("50 positions; done\n", err)
            self.assertEqual("50.000 0.000 0.000", out.splitlines()[-1])
            self.assertIn("stopped at", self.run_example("stop_from_thread", rig.path, "MP-225", "1000")[0])
            self.assertEqual(["drive 1 at 300.000 300.000 150.000 um = 4800 4800 2400 steps",
                              "drive 2 at 300.000 300.000 150.000 um = 3840 3840 1920 steps"],
                             self.run_example("two_drives", rig.path, "MP-225", "MT-800")[0].splitlines())


if __name__ == "__main__":
    unittest.main()
