"""`dryrig-emu run`: the command's exit status, signals, streams and environment are its own, and nothing is left behind."""
import os
import signal
import subprocess
import sys
import threading
import unittest

import emu

HOST = """
import os, sys
port = os.open(os.environ["DRYRIG_PORT"], os.O_RDWR | os.O_NOCTTY)
os.write(port, b"K")
got = b""
while len(got) < 4:
    got += os.read(port, 4)
sys.stdout.buffer.write(got)
"""


class Run(unittest.TestCase):
    def setUp(self):
        self.directory = self.enterContext(emu.directory()) if hasattr(self, "enterContext") else None
        if self.directory is None:
            context = emu.directory()
            self.directory = context.__enter__()
            self.addCleanup(context.__exit__, None, None, None)
        self.environment = dict(os.environ, TMPDIR=self.directory)

    def tearDown(self):
        self.assertEqual(os.listdir(self.directory), [], "something is left behind")

    def run_(self, *args, **options):
        return subprocess.run([emu.PROGRAM, "run", *args], stdin=subprocess.DEVNULL, capture_output=True,
                              env=self.environment, timeout=emu.LIMIT_S, check=False, **options)

    def test_the_command_finds_the_port_and_stdout_is_its_own(self):
        done = self.run_("mpc", "--", sys.executable, "-c", HOST)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, b"\x01\x21\x03\r", b""))

    def test_the_command_is_told_of_a_fast_clock(self):
        for options, told in ((), b"-"), (("--clock", "jump"), b"1"), (("--clock", "step"), b"1"), (("--speedup", "9"), b"1"):
            done = self.run_(*options, "trio", "--", "sh", "-c", 'printf "${DRYRIG_FAST:--}"')
            self.assertEqual(done.stdout, told)

    def test_its_exit_status_is_ours(self):
        for status in (0, 1, 3, 77, 125, 255):
            self.assertEqual(self.run_("trio", "--", "sh", "-c", f"exit {status}").returncode, status)

    def test_a_signal_that_ends_it(self):
        for number in (signal.SIGTERM, signal.SIGKILL, signal.SIGSEGV, signal.SIGPIPE):
            self.assertEqual(self.run_("mpc", "--", "sh", "-c", f"kill -{int(number)} $$").returncode, 128 + number)

    def test_a_command_that_cannot_start(self):
        done = self.run_("mpc", "--", "/no/such/program")
        self.assertEqual((done.returncode, done.stdout), (127, b""))
        self.assertIn(b"/no/such/program", done.stderr)
        self.assertEqual(self.run_("mpc", "--", "no-such-program-anywhere").returncode, 127)
        done = self.run_("mpc", "--", "/etc/passwd")
        self.assertEqual(done.returncode, 126)
        self.assertIn(b"/etc/passwd", done.stderr)
        self.assertEqual(self.run_("mpc", "--", "/").returncode, 126)

    def test_signals_are_passed_on(self):
        script = "trap 'echo got; exit 9' TERM; trap 'exit 8' USR1; trap 'exit 7' INT; echo up; while :; do read x; done"
        for number, status in ((signal.SIGTERM, 9), (signal.SIGUSR1, 8), (signal.SIGINT, 7)):
            process = subprocess.Popen([emu.PROGRAM, "run", "mpc", "--", "bash", "-c", script], stdin=subprocess.PIPE,
                                       stdout=subprocess.PIPE, env=self.environment)
            self.assertEqual(process.stdout.readline(), b"up\n")
            process.send_signal(number)
            process.communicate(timeout=emu.LIMIT_S)
            self.assertEqual(process.returncode, status)

    def test_the_command_has_the_signals_it_would_have_without(self):
        done = self.run_("mpc", "--", "cat", "/proc/self/status")
        lines = dict(line.split(":\t") for line in done.stdout.decode().splitlines() if ":\t" in line)
        mine = subprocess.run(["cat", "/proc/self/status"], capture_output=True, check=True).stdout.decode()
        usual = dict(line.split(":\t") for line in mine.splitlines() if ":\t" in line)
        for mask in ("SigBlk", "SigIgn"):
            standard = 0x7fffffff  # not the two that the C library keeps for itself
            self.assertEqual(int(lines[mask], 16) & standard, int(usual[mask], 16) & standard, mask)

    def test_it_keeps_no_descriptor_of_ours(self):
        done = self.run_("mpc", "--", "ls", "/proc/self/fd")
        self.assertEqual(done.stdout.split(), [b"0", b"1", b"2", b"3"])  # 3: ls reads the directory

    def test_a_link_that_was_asked_for_is_what_the_command_gets(self):
        link = os.path.join(self.directory, "rig")
        done = self.run_("mpc", "--link", link, "--", "sh", "-c", 'echo "$DRYRIG_PORT"; readlink "$DRYRIG_PORT"')
        self.assertEqual(done.stdout.decode().splitlines()[0], link)
        self.assertTrue(done.stdout.decode().splitlines()[1].startswith("/dev/pts/"))

    def test_several_at_once_do_not_disturb_each_other(self):
        def one(number):
            for _ in range(5):
                done = self.run_("mpc", "--", sys.executable, "-c", HOST + f"\nsys.exit({number})")
                results.append((done.returncode, done.stdout) == (number, b"\x01\x21\x03\r"))
        results = []
        threads = [threading.Thread(target=one, args=(number,)) for number in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(results, [True] * 20)

    def test_many_in_a_row_leave_nothing(self):
        for _ in range(100):
            self.assertEqual(self.run_("trio", "--", "true").returncode, 0)

    def test_wrong_options(self):
        for args, words in ((["mpc"], "which command"), (["mpc", "--"], "which command"), (["--", "true"], "trio or mpc"),
                            (["mpc", "trio", "--", "true"], "trio")):
            done = self.run_(*args)
            self.assertEqual(done.returncode, 2, args)
            self.assertIn(words, done.stderr.decode())
        done = subprocess.run([emu.PROGRAM, "mpc", "--", "true"], capture_output=True, check=False, timeout=emu.LIMIT_S)
        self.assertEqual(done.returncode, 2)


if __name__ == "__main__":
    emu.main()
