"""`dryrig-emu run`: the command's exit status, signals, streams and environment are its own, and nothing is left behind."""
import os
import resource
import shutil
import signal
import subprocess
import sys
import threading

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


class Run(emu.InDirectory):
    def setUp(self):
        super().setUp()
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
        script = ("trap 'exit 10' TERM; trap 'exit 8' USR1; trap 'exit 7' INT; trap 'exit 9' HUP; trap 'exit 11' QUIT; "
                  "trap 'exit 12' USR2; echo up; while :; do read x; done")
        for number, status in ((signal.SIGTERM, 10), (signal.SIGUSR1, 8), (signal.SIGINT, 7), (signal.SIGHUP, 9),
                               (signal.SIGQUIT, 11), (signal.SIGUSR2, 12)):
            process = subprocess.Popen([emu.PROGRAM, "run", "mpc", "--", "bash", "-c", script], stdin=subprocess.PIPE,
                                       stdout=subprocess.PIPE, env=self.environment)
            self.assertEqual(process.stdout.readline(), b"up\n")
            process.send_signal(number)
            process.communicate(timeout=emu.LIMIT_S)
            self.assertEqual(process.returncode, status)

    def test_quit_is_the_controllers_end_and_not_the_commands(self):
        """Otherwise a test suite that says `quit` when it is done would pass, whatever comes of it."""
        script = ('%s ctl "$DRYRIG_CONTROL" quit >/dev/null; while [ -e "$DRYRIG_PORT" ]; do sleep 0.01; done; '
                  'trap "exit 6" TERM; echo gone; for i in $(seq 6000); do sleep 0.01; done')
        for options in (), ("--strict", "--clock", "jump"):
            process = subprocess.Popen([emu.PROGRAM, "run", *options, "mpc", "--", "sh", "-c", script % emu.PROGRAM],
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=self.environment)
            self.assertEqual(process.stdout.readline(), b"gone\n")
            self.assertIsNone(process.poll())
            process.send_signal(signal.SIGTERM)  # passed on, as before
            self.assertEqual(process.communicate(timeout=emu.LIMIT_S), (b"", b""))
            self.assertEqual(process.returncode, 6)
        self.assertEqual(self.run_("mpc", "--do", "quit", "--", "sh", "-c", "exit 6").returncode, 6)
        done = self.run_("mpc", "--do", "on K quit", "--", "sh", "-c",
                         'exec 3<>"$DRYRIG_PORT"; printf K >&3; cat <&3 >/dev/null 2>&1; exit 6')
        self.assertEqual(done.returncode, 6)
        self.assertEqual(self.processes(), [])

    def test_a_port_that_hangs_up_is_seen_by_the_command(self):
        host = ('import os\nport = os.open(os.environ["DRYRIG_PORT"], os.O_RDWR | os.O_NOCTTY)\n'
                'os.system(sys_ctl)\ntry:\n    data = os.read(port, 1)\nexcept OSError:\n    data = b""\nos._exit(40 + len(data))')
        host = f"sys_ctl = '{emu.PROGRAM} ctl $DRYRIG_CONTROL quit >/dev/null'\n" + host
        self.assertEqual(self.run_("mpc", "--", sys.executable, "-c", host).returncode, 40)

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

    def test_a_tmpdir_that_is_too_long_for_a_socket(self):
        """Its path has 107 bytes at most; those of CI servers can be longer. /tmp will do."""
        for length, is_short in ((85, True), (86, False), (200, False)):
            where = os.path.join(self.directory, "d" * (length - len(self.directory) - 1))
            os.mkdir(where)
            self.environment["TMPDIR"] = where
            done = self.run_("mpc", "--", "sh", "-c", 'dirname "$DRYRIG_CONTROL"; "$0" ctl "$DRYRIG_CONTROL" state >&2',
                             emu.PROGRAM)
            os.rmdir(where)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn(b'"ok":true', done.stderr)
            self.assertEqual(os.path.dirname(done.stdout.decode()), where if is_short else "/tmp")
            self.assertFalse(os.path.exists(done.stdout.decode().strip()))

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
        for _ in range(int(os.environ.get("DRYRIG_RUNS", "100"))):
            self.assertEqual(self.run_("trio", "--", "true").returncode, 0)
        self.assertEqual(self.processes(), [])
        with open("/proc/net/unix", encoding="utf-8", errors="replace") as file:
            self.assertEqual([line for line in file if self.directory in line], [])

    def processes(self):
        """Those that have been started here and are still there."""
        found = []
        for number in filter(str.isdigit, os.listdir("/proc")):
            try:
                with open(f"/proc/{number}/environ", "rb") as file:
                    if b"TMPDIR=" + self.directory.encode() in file.read().split(b"\0"):
                        found.append(int(number))
            except OSError:
                pass  # it has ended meanwhile, or is somebody else's
        return found

    def test_streams_that_are_closed_or_full_are_so_for_the_command_too(self):
        script = "echo x 2>/dev/null; a=$?; echo y >&2; echo $a $? >>status; exit 5"
        for ending in (">&-", ">/dev/full", "2>&-", "<&- >&- 2>&-"):
            seen = []
            for before in ([], [emu.PROGRAM, "run", "mpc", "--lint=off", "--"]):
                done = subprocess.run(["sh", "-c", f'"$@" {ending}', "sh", *before, "sh", "-c", script], check=False,
                                      capture_output=True, env=self.environment, cwd=self.directory, timeout=emu.LIMIT_S)
                with open(os.path.join(self.directory, "status"), encoding="ascii") as file:
                    seen.append((done.returncode, file.read(), done.stdout))
                os.remove(os.path.join(self.directory, "status"))
            self.assertEqual(seen[0], seen[1], ending)

    def test_a_command_that_closes_its_streams(self):
        self.assertEqual(self.run_("mpc", "--", "sh", "-c", "exec <&- >&- 2>&-; exit 6").returncode, 6)

    def start_(self, script, *options):
        process = subprocess.Popen([emu.PROGRAM, "run", *options, "mpc", "--", "bash", "-c", script], stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=self.environment)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        return process

    def test_a_command_that_does_not_mind_a_signal_goes_on(self):
        process = self.start_("trap 'echo no' TERM HUP; trap 'exit 5' USR2; echo up; while :; do read -t 0.01 x; done")
        self.assertEqual(process.stdout.readline(), b"up\n")
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGTERM):
            process.send_signal(number)
            self.assertEqual(process.stdout.readline(), b"no\n")
        self.assertIsNone(process.poll())
        process.send_signal(signal.SIGUSR2)
        self.assertEqual(process.wait(timeout=emu.LIMIT_S), 5)

    def test_what_cannot_be_written_is_no_success(self):
        ask = 'exec 3<>"$DRYRIG_PORT"; printf K >&3; head -c 4 <&3 >/dev/null; exit '
        for option in ("--lint-json", "--lint-junit", "--trace"):
            for status, ours in ((0, 1), (7, 7)):
                done = self.run_("mpc", option, "/dev/full", "--", "sh", "-c", ask + str(status))
                self.assertEqual(done.returncode, ours, option)
                self.assertIn(b"/dev/full", done.stderr)
        early = 'exec 3<>"$DRYRIG_PORT"; printf KK >&3; head -c 8 <&3 >/dev/null'
        done = self.run_("mpc", "--strict", "--lint-json", "/dev/full", "--", "sh", "-c", early)
        self.assertEqual(done.returncode, 3)
        self.assertIn(b"early-command", done.stderr)

    def test_a_disk_that_fills_up_is_no_success(self):
        """A recording or a trace of 300 questions has more than 8 kB; a limit on the size of files stands for the disk."""
        host = HOST.replace('os.write(port, b"K")', 'for i in range(300):\n  os.write(port, b"K")').replace(
            'got = b""', '  got = b""').replace("while", "  while")
        path = os.path.join(self.directory, "report")
        # What a build for coverage counts is elsewhere, where it may be cut off.
        with emu.directory() as counts:
            environment = {**self.environment, "GCOV_PREFIX": counts}
            for option in ("--record", "--trace", "--lint-json"):
                for limit, status in ((1024, 1), (1 << 30, 0)):
                    done = subprocess.run([emu.PROGRAM, "run", "mpc", option, path, "--", sys.executable, "-c", host],
                                          capture_output=True, env=environment, timeout=emu.LIMIT_S, check=False,
                                          restore_signals=False,  # SIGXFSZ stays ignored: writing fails
                                          preexec_fn=lambda most=limit: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most)))
                    self.assertEqual((done.returncode, done.stdout), (status, b"\x01\x21\x03\r"), (option, done.stderr))
                    self.assertEqual(path.encode() in done.stderr, status == 1, done.stderr)
                    os.remove(path)

    def test_what_the_command_leaves_running_is_not_waited_for(self):
        process = self.start_('exec 3<>"$DRYRIG_PORT"; (trap "" HUP; read -u 3 x; echo "gone $x" >"$TMPDIR/late") & echo $!; exit 4')
        process.stdout.readline()
        self.assertEqual(process.wait(timeout=emu.LIMIT_S), 4)  # it reads the port as long as there is one
        late = os.path.join(self.directory, "late")
        emu.wait_until(lambda: os.path.exists(late) and os.path.getsize(late) > 0, "the port of one left running hangs up")
        os.remove(late)
        emu.wait_until(lambda: self.processes() == [], "it ends")

    def test_the_runner_is_killed(self):
        """Nobody can clean up then: the command goes on with a port that has hung up; the next run puts the link right."""
        link = os.path.join(self.directory, "rig")
        process = self.start_('exec 3<>"$DRYRIG_PORT"; echo up; read -u 3 x; echo "hung up $x"; exit 0', "--link", link)
        self.assertEqual(process.stdout.readline(), b"up\n")
        process.kill()
        self.assertEqual(process.stdout.readline(), b"hung up \n")
        process.wait(timeout=emu.LIMIT_S)
        emu.wait_until(lambda: self.processes() == [], "the command ends")
        self.assertTrue(os.path.islink(link))
        for left in os.listdir(self.directory):  # what was the killed one's own
            if left.startswith("dryrig-"):
                shutil.rmtree(os.path.join(self.directory, left))
        self.assertEqual(self.run_("mpc", "--link", link, "--", sys.executable, "-c", HOST).stdout, b"\x01\x21\x03\r")

    def test_wrong_options(self):
        for args, words in ((["mpc"], "which command"), (["mpc", "--"], "which command"), (["--", "true"], "trio or mpc"),
                            (["mpc", "trio", "--", "true"], "trio"), (["mpc", "sh", "status.sh"], "stands behind --")):
            done = self.run_(*args)
            self.assertEqual(done.returncode, 2, args)
            self.assertIn(words, done.stderr.decode())
        done = subprocess.run([emu.PROGRAM, "mpc", "--", "true"], capture_output=True, check=False, timeout=emu.LIMIT_S)
        self.assertEqual(done.returncode, 2)


if __name__ == "__main__":
    emu.main()
