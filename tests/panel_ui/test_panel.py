"""dryrig-panel in a terminal: what it shows and what its keys do, through tmux; the emulator's clock is moved by the test.

Numbers are those of test_hands.py."""
import contextlib
import os
import signal
import subprocess
import tempfile
import unittest

import emu
from ctl import Rehearsal

PANEL = os.environ["DRYRIG_PANEL"]


class Terminal:
    """A terminal with a shell in it, and a panel that the shell has started."""

    def __init__(self, *args, columns=80, rows=24, term="tmux-256color"):
        self.context = tempfile.TemporaryDirectory(prefix="dryrig-")
        self.socket = os.path.join(self.context.__enter__(), "tmux")
        self.before = os.path.join(self.context.name, "before")
        self.after = os.path.join(self.context.name, "after")
        with open(os.path.join(self.context.name, "conf"), "w", encoding="ascii") as conf:
            conf.write(f"set -g default-terminal {term}\nset -g status off\n")
        command = " ".join(f"'{word}'" for word in args)
        shell = (f"trap : INT QUIT; stty -g >{self.before}; {command}; echo \"status $?\"; stty -g >{self.after}.part;"
                 f" mv {self.after}.part {self.after}; exec cat")
        self.tmux("-f", os.path.join(self.context.name, "conf"), "new-session", "-d", "-s", "panel", "-x", str(columns),
                  "-y", str(rows), "sh", "-c", shell)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """Nothing stays behind: the panel ends before its terminal does."""
        try:
            if not os.path.exists(self.after):
                with contextlib.suppress(ProcessLookupError, IndexError):
                    os.kill(self.child(), signal.SIGTERM)
                emu.wait_until(lambda: os.path.exists(self.after), "the panel ends")
        finally:
            self.tmux("kill-server")
        self.context.__exit__(None, None, None)

    def tmux(self, *args):
        environment = {name: value for name, value in os.environ.items() if name not in ("TMUX", "TMUX_PANE")}
        environment["LC_ALL"] = "C.UTF-8"
        return subprocess.run(["tmux", "-S", self.socket, *args], check=True, stdout=subprocess.PIPE, env=environment,
                              timeout=emu.LIMIT_S).stdout.decode()

    def text(self):
        return self.tmux("capture-pane", "-p", "-t", "panel")

    def rows(self):
        return self.text().split("\n")

    def colours(self):
        return self.tmux("capture-pane", "-p", "-e", "-t", "panel")

    def keys(self, *keys):
        self.tmux("send-keys", "-t", "panel", *keys)

    def resize(self, columns, rows):
        self.tmux("resize-window", "-t", "panel", "-x", str(columns), "-y", str(rows))

    def shows(self, *texts):
        """Waits until all of them are there. Returns the screen."""
        def there():
            self.last = self.text()
            return all(text in self.last for text in texts)
        try:
            emu.wait_until(there, texts)
        except AssertionError as error:
            raise AssertionError(f"{error}\n{self.last}") from None
        return self.last

    def child(self):
        """The panel's process."""
        shell = self.tmux("display-message", "-p", "-t", "panel", "#{pane_pid}").strip()
        with open(f"/proc/{shell}/task/{shell}/children", encoding="ascii") as file:
            return int(file.read().split()[0])

    def is_left(self):
        flags = self.tmux("display-message", "-p", "-t", "panel", "#{alternate_on} #{cursor_flag} #{keypad_flag}")
        return flags.strip() == "0 1 0"

    def ended(self, status):
        """Waits until the panel has ended, and sees that the terminal is as it was."""
        emu.wait_until(lambda: os.path.exists(self.after), "the panel ends")
        self.shows(f"status {status}")
        with open(self.before, encoding="ascii") as before, open(self.after, encoding="ascii") as after:
            if before.read() != after.read():
                raise AssertionError("the terminal is not as it was")
        if not self.is_left():
            raise AssertionError("the alternate screen, the hidden cursor, or the keypad is still there")
        return self.tmux("capture-pane", "-p", "-J", "-t", "panel")


def trio(*args):
    return Rehearsal("trio", "--clock", "step", *args)


def mpc(*args):
    return Rehearsal("mpc", "--clock", "step", *args)


GREEN, BLUE, RED, WHITE = "\x1b[30m\x1b[42m", "\x1b[37m\x1b[44m", "\x1b[37m\x1b[41m", "\x1b[30m\x1b[47m"


class Screens(unittest.TestCase):
    def test_at_rest(self):
        with trio() as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("green", "X   1000.03  ABSOLUTE", "Y   1000.03  ANGLE 30", "Z   1000.03  SPEED 0", "D   1366.06",
                    "h HOME", "w WORK", "p PULSE (ANGLE)", "r RELATIVE", "s SPEED (LOCK)", "? help",
                    "c answers AB 29 00 00 AB 29 00 00 AB 29 00 00 1E 0D",
                    "= X 10,667, Y 10,667, Z 10,667 microsteps of 0.09375 um, 30 degrees",
                    "MP-845   H home 0.00, 0.00, 0.00 um   W work none is stored")
            rows = t.rows()
            self.assertTrue(rows[0].startswith(" TRIO MP-245A 3.12  /dev/pts/") or rows[0].startswith(" TRIO MP-245A 3.12  /"))
            self.assertIn("nobody has it open", rows[0])
            self.assertEqual(rows[11][29], "O")  # from above: at the lower left, Y goes up
            self.assertEqual(rows[2][55], "O")  # from the side: at the upper left, Z goes down
            self.assertIn(GREEN, t.colours())
            self.assertLessEqual(max(len(row) for row in rows), 80)

    def test_moving(self):
        with trio("--position", "200000,200000,200000") as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("green")
            e.do("press home")
            e.do("advance 2100ms")  # Z: 10,000 of 18,750 um
            t.shows("red", "Z   8750", "HOME", "c waits for the end of the move; on the way there now:", "by hand: go home")
            self.assertNotIn("c answers", t.text())  # what it will answer is not where it is now
            self.assertIn(RED, t.colours())
            rows = [row[55:79] for row in t.rows()[2:12]]
            column = "".join(row[17] for row in rows)
            self.assertEqual(column.index("x"), 0)  # where this leg ends: Z 0
            self.assertEqual(column.index("O"), 3)  # 8,750 of 25,000 um, ten rows
            self.assertEqual(column[6], "\N{MIDDLE DOT}")  # where it comes from
            e.do("advance until idle")
            t.shows("green", "X      0.00", "has arrived at")

    def test_relative(self):
        with trio() as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("green")
            t.keys("R")
            emu.wait_until(lambda: e.do("panel")["down"] == ["relative"], "R holds RELATIVE")
            e.do("advance 3s")
            t.shows("beep")
            t.keys("r")
            emu.wait_until(lambda: e.do("panel")["down"] == ["relative"], "r presses RELATIVE")
            e.do("advance 100ms")
            t.shows("blue", "X      0.00  RELATIVE")
            t.keys("Left")
            t.shows("X    -60.00  RELATIVE", "c answers 2B 27 00 00", "absolute, always")
            self.assertIn(BLUE, t.colours())

    def test_lock(self):
        with trio() as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("green")
            t.keys("S")
            emu.wait_until(lambda: e.do("panel")["down"] == ["speed"], "S holds SPEED")
            e.do("advance 3s")
            t.shows("red", "LOCK", "beep")
            t.keys("Right")
            t.keys("?")
            t.shows("First steps")
            self.assertEqual(e.position(), [10667] * 3)

    def test_diagonal(self):
        with mpc("--position", "16000,16000,16000") as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("X   1000.00  DRIVE 1", "NORM", "( ) LED", "C answers 01 80 3E 00 00")
            self.assertIn(WHITE, t.colours())
            t.keys("d")
            t.shows("X      0.00  DRIVE 1", "DIAG 29", "D      0.00", "(*) LED", "absolute, always")
            t.keys("n", "NPage")  # 100 detents of mode 0 at once: twice 64, at least
            t.shows("was moved by hand")
            x, _, z = e.position()
            self.assertGreater(x, z)
            self.assertGreater(z, 16000)

    def test_several_drives(self):
        with mpc("--device", "MP-225", "--device", "MP-285", "--device", "none", "--device", "MP-265") as e, \
                Terminal(PANEL, e.socket_path) as t:
            t.shows(" 1 MP-225 0/0/0  2 MP-285 0/0/0  3 none  4 MP-265 0/0/0", "DRIVE 1")
            t.keys("m")
            t.shows("DRIVE 2", "C answers 02", "device 2")
            t.keys("m")
            t.shows("DRIVE 4")
            t.keys("+", "+")
            t.shows("MODE 2")
            t.keys("M")
            t.shows("DRIVE 2", "MODE 0")
            e.do("set position 4 400000,200000,400000")
            t.shows("4 MP-265 25000/12500/25000")
            e.do("set position 2 400000,400000,400000")
            e.do("set position 1 400000,400000,400000")
            t.shows(" 1 25000/25000/25000  2 25000/25000/25000  3 none  4 25000/12500/25000")

    def test_nothing_connected_and_no_power(self):
        with mpc("--device", "none") as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("NO MANIPULATOR", "CONNECTED", "nothing is connected", "gets no answer now")
            t.keys("o")
            t.shows("dark")
            self.assertEqual(e.controller()["state"], "off")
            t.keys("o")
            t.shows("CONNECTED")

    def test_too_small_and_resized(self):
        with trio() as e, Terminal(PANEL, e.socket_path, columns=79, rows=24) as t:
            t.shows("needs 80 x 24 characters, here are 79 x 24")
            t.resize(20, 5)
            t.shows("This panel needs 80\nx 24 characters,", "q quits.")
            t.resize(120, 40)
            t.shows("ABSOLUTE", "? help")
            self.assertIn("? help", t.rows()[39])
            t.resize(80, 24)
            emu.wait_until(lambda: "? help" in t.rows()[23], "it fits the new size")
            t.shows("ABSOLUTE", "s SPEED (LOCK)")
            t.resize(1, 5)  # no word fits, nor half of one
            emu.wait_until(lambda: t.rows()[0] == "T", "it draws on a single column")
            t.resize(80, 24)
            t.shows("ABSOLUTE", "s SPEED (LOCK)")
            t.keys("q")
            t.ended(0)


class Keys(unittest.TestCase):
    def test_a_newcomer_homes_stores_moves_and_sees_an_answer(self):
        with trio() as e, Terminal(PANEL, e.socket_path) as t, emu.Port(e.path) as port:
            t.shows("green")
            t.keys("?")
            t.shows("First steps: h goes home", "W stores the place")
            t.keys("q")  # any key: back
            t.shows("ABSOLUTE")
            t.keys("h")
            emu.wait_until(lambda: e.do("panel")["down"] == ["home"], "h presses HOME")
            e.do("advance until idle")
            t.shows("X      0.00", "Z      0.00")
            t.keys("Right", "Right", "Up", "NPage", "]")
            emu.wait_until(lambda: e.position()[1] == 640 and e.position()[2] > 640, "arrows turn the knobs")
            at = e.position()
            t.keys("W")
            emu.wait_until(lambda: e.do("panel")["down"] == ["work"], "W holds WORK")
            e.do("advance 3s")
            self.assertEqual(e.controller()["devices"][0]["work_steps"], at)
            t.shows("beep", "this place is the work position")
            port.send(b"c")
            e.do("advance 10ms")
            self.assertEqual(port.receive(14), emu.point(*at) + b"\x1e\r")
            t.shows("> 63", "< " + (emu.point(*at) + b"\x1e\r").hex(" ").upper())

    def test_a_button_is_seen_to_be_down(self):
        with trio() as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("green")
            t.keys("p")
            emu.wait_until(lambda: "\x1b[7mPULSE (ANGLE)" in t.colours(), "PULSE is inverted")
            e.do("advance 100ms")
            emu.wait_until(lambda: "\x1b[7mPULSE (ANGLE)" not in t.colours(), "and is not any more")
            self.assertEqual(e.position(), [10667 + 26, 10667, 10667 + 15])

    def test_detents(self):
        with trio() as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("10 detents a key")
            t.keys("n")
            t.shows(" 100 detents a key")
            t.keys("n")
            t.shows("1000 detents a key")
            t.keys("n")
            t.shows("1 detent a key")
            t.keys("Right")
            emu.wait_until(lambda: e.position()[0] == 10667 + 64, "one detent of SPEED 0")

    def test_store_with_stop_and_work_and_go_there(self):
        with mpc() as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("DRIVE 1")
            t.keys("+", "+", "+", "+", "+", "Right")
            emu.wait_until(lambda: e.position() == [160, 0, 0], "mode 5: 1 um a detent")
            t.keys("S")
            emu.wait_until(lambda: e.do("panel")["down"] == ["work", "stop"], "S presses both")
            e.do("advance 1s")
            t.shows("beep")
            self.assertEqual(e.controller()["devices"][0]["work_steps"], [160, 0, 0])

    def test_a_control_that_does_nothing_says_why(self):
        with trio() as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("green")
            t.keys("w")
            t.shows("no work position is stored yet: W stores this place")
            emu.wait_until(lambda: e.do("panel")["down"] == ["work"], "w presses WORK")
            e.do("advance until idle")
            t.shows("no work position is stored: nothing moves")  # in the log
            t.keys("S")
            emu.wait_until(lambda: e.do("panel")["down"] == ["speed"], "S holds SPEED")
            e.do("advance 3s")
            t.shows("1366.06  LOCK")
            t.keys("Right")
            t.shows("the knobs are locked: S unlocks them")
            t.keys("h")
            emu.wait_until(lambda: e.do("panel")["down"] == ["home"], "buttons are not")
            e.do("advance 200ms")
            t.shows("waits for the end of the move")
            t.keys("]")
            t.shows("it moves: the knobs are dead until it is there")
            t.keys("p")
            t.shows("it moves: only the button of this move works, and pauses it")
            t.keys("h")
            emu.wait_until(lambda: "home" in e.do("panel")["down"], "HOME does")
            e.do("advance 200ms")
            t.shows("PAUSED")
            e.do("power off")
            t.shows("dark")
            t.keys("h")
            t.shows("it has no power: o switches it on")

    def test_a_control_of_an_mpc_that_does_nothing_says_why(self):
        with mpc("--device", "MP-225", "--device", "none") as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("DRIVE 1")
            t.keys("w")
            t.shows("no work position is stored yet: S stores this place")
            emu.wait_until(lambda: e.do("panel")["down"] == ["work"], "w presses WORK POS.")
            e.do("advance until idle")
            t.keys("W")
            emu.wait_until(lambda: e.do("panel")["down"] == ["work"], "W holds WORK POS.")
            e.do("advance 2s")
            t.shows("LOCK")
            for key in ("Right", "+", "h", "d"):
                t.keys(key)
                t.shows("this drive is locked: W unlocks it")
                t.keys("m")
                t.shows("no other device is connected")
            self.assertEqual(e.position(), [0, 0, 0])
            e.do("set position 1 100000,0,0")
            e.do("hold work 2s")
            e.do("advance 2s")
            e.do("press home")
            e.do("advance 200ms")
            t.shows("waits for the end of the move")
            t.keys("Up")
            t.shows("it moves: only STOP works until it is there")
            t.keys("s")
            emu.wait_until(lambda: e.do("panel")["moving"] is None, "STOP does")

    def test_a_command_is_typed(self):
        with trio() as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("green")
            t.keys(":", *"switch rear 6 ofx", "BSpace", "f")
            t.shows(":switch rear 6 off_")
            t.keys("Enter")
            emu.wait_until(lambda: not e.do("panel")["switches"]["rear"][5], "the switch is off")
            t.keys(":", *"switch rear 7 on", "Enter")
            t.shows("expected a whole number from 1 to 6")
            t.keys(":", *"q", "Escape")
            t.shows("? help")
            t.keys("Y")
            t.shows("that key does nothing")

    def test_the_controllers_of_a_rig(self):
        with emu.directory() as directory:
            path = os.path.join(directory, "rig")
            with open(path, "w", encoding="ascii") as file:
                file.write('controllers = ( { controller = "trio"; name = "left"; }, { controller = "mpc"; name = "right"; } );')
            socket = os.path.join(directory, "control")
            process = emu.start("rig", path, "--control", socket)
            try:
                process.stdout.readline()
                with Terminal(PANEL, socket) as t:
                    t.shows("TRIO MP-245A", "'left', Tab: next", "ABSOLUTE")
                    t.keys("Tab")
                    t.shows("MPC-200", "'right', Tab: next", "DRIVE 1")
                    t.keys("Tab")
                    t.shows("TRIO MP-245A", "'left', Tab: next", "ABSOLUTE")
                with Terminal(PANEL, socket, "right") as t:
                    t.shows("MPC-200", "DRIVE 1")
                with Terminal(PANEL, socket, "middle") as t:
                    self.assertIn("there is no controller 'middle'", t.ended(1))
            finally:
                process.send_signal(signal.SIGTERM)
                process.communicate(timeout=emu.LIMIT_S)


class Clock(unittest.TestCase):
    """Whoever sees nothing happen is told why, and what helps."""

    def test_one_that_stands(self):
        with trio() as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("the clock stands: ':advance 1s' moves it   ? help   q ends the panel alone")
            t.keys("h")
            emu.wait_until(lambda: e.do("panel")["down"] == ["home"], "h presses HOME")
            t.keys(":", *"advance 1s", "Enter")
            t.shows("X      0.00", "step 1.000 s")

    def test_one_that_goes(self):
        for clock in "real", "jump":
            with Rehearsal("trio", "--clock", clock) as e, Terminal(PANEL, e.socket_path) as t:
                t.shows(" ? help   o mains off, on   : any command   q ends the panel alone")

    def test_one_that_waits_for_a_host(self):
        with Rehearsal("trio", "--wait-client") as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("the clock waits until a host opens the port   ? help   q ends the panel alone")
            self.assertTrue(e.do("state")["waits_for_client"])
            with emu.Port(e.path):
                t.shows(": any command")
            self.assertFalse(e.do("state")["waits_for_client"])

    def test_an_emulator_that_is_stopped(self):
        with trio() as e, Terminal(PANEL, e.socket_path) as t:
            t.shows("X   1000.03  ABSOLUTE", "the clock stands")
            os.kill(e.process.pid, signal.SIGSTOP)
            try:
                t.shows("NO ANSWER since", "The emulator has not answered for", "What is shown is old, and keys wait.")
                self.assertIn("step 0.000 s", t.rows()[0])
                self.assertLessEqual(max(len(row) for row in t.rows()), 80)
                t.keys("Right", "?")  # waits, and needs no emulator
                t.shows("First steps")
                t.keys("?")
            finally:
                os.kill(e.process.pid, signal.SIGCONT)
            t.shows("X   1060.03  ABSOLUTE")
            emu.wait_until(lambda: "answer" not in t.rows()[23] and "ANSWER" not in t.rows()[0], "it answers again")

    def test_a_panel_of_a_stopped_emulator_ends(self):
        with trio() as e:
            os.kill(e.process.pid, signal.SIGSTOP)
            try:
                with Terminal(PANEL, e.socket_path) as t:
                    t.shows("waiting for the emulator", "It has not answered for")
                    t.keys("q")
                    t.ended(0)
            finally:
                os.kill(e.process.pid, signal.SIGCONT)


class Ends(unittest.TestCase):
    def test_q_and_signals(self):
        with trio() as e:
            for how in ("q", "C-c", "C-\\", signal.SIGTERM, signal.SIGHUP):
                with Terminal(PANEL, e.socket_path) as t:
                    t.shows("ABSOLUTE")
                    if isinstance(how, str):
                        t.keys(how)
                    else:
                        os.kill(t.child(), how)
                    t.ended(0)

    def test_the_emulator_ends(self):
        with trio() as e:
            with Terminal(PANEL, e.socket_path) as t:
                t.shows("ABSOLUTE")
                e.stop(signal.SIGKILL)
                self.assertIn("the emulator has ended", t.ended(1))
            os.unlink(e.socket_path)
            os.unlink(e.link)
            e.process.returncode = 0  # as was asked for

    def test_there_is_none(self):
        with Terminal(PANEL, "/nonexistent/socket") as t:
            self.assertIn("Does dryrig-emu run with --control there?", t.ended(1))

    def test_no_terminal(self):
        done = subprocess.run([PANEL, "socket"], stdin=subprocess.DEVNULL, capture_output=True, timeout=emu.LIMIT_S, check=False)
        self.assertEqual((done.returncode, done.stdout), (2, b""))
        self.assertIn(b"a terminal is needed", done.stderr)
        done = subprocess.run([PANEL], stdin=subprocess.DEVNULL, capture_output=True, timeout=emu.LIMIT_S, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn(b"which emulator?", done.stderr)

    def test_a_terminal_that_nobody_knows(self):
        for term in "nobody-knows", "dumb":  # the second one cannot move its cursor
            with trio() as e, Terminal("env", "TERM=" + term, PANEL, e.socket_path) as t:
                self.assertIn(f"the terminal '{term}' cannot be drawn on", t.ended(2))

    def test_a_terminal_without_colours(self):
        with trio() as e, Terminal("env", "TERM=vt100", PANEL, e.socket_path) as t:
            t.shows("green", "ABSOLUTE")
            t.keys("q")
            emu.wait_until(lambda: os.path.exists(t.after), "the panel ends")


class InTheSameTerminal(unittest.TestCase):
    """dryrig-emu ... --panel"""

    def setUp(self):
        self.directory = self.enterContext(emu.directory())
        os.environ["TMPDIR"] = self.directory
        self.addCleanup(os.environ.pop, "TMPDIR")

    def panel_of(self, terminal):
        pid = terminal.child()
        with open(f"/proc/{pid}/task/{pid}/children", encoding="ascii") as file:
            return int(file.read().split()[0])

    def emulator(self, *args):
        return Terminal("env", "TMPDIR=" + self.directory, emu.PROGRAM, *args)

    def test_it_ends_with_its_panel(self):
        for args in (("trio",), ("mpc", "--clock", "jump")):
            with self.emulator(*args, "--panel") as t:
                t.shows("0.00", "? help", "q ends the emulator too")
                t.keys("q")
                text = t.ended(0)
                self.assertNotIn("dryrig", text)
        self.assertEqual(os.listdir(self.directory), [])

    def test_a_panel_that_is_killed_leaves_the_terminal_usable(self):
        with self.emulator("trio", "--panel") as t:
            t.shows("ABSOLUTE")
            os.kill(self.panel_of(t), signal.SIGKILL)
            t.ended(128 + signal.SIGKILL)
            t.keys(*"typed", "Enter")  # by the cat that the shell has become
            t.shows("typed\ntyped")
        self.assertEqual(os.listdir(self.directory), [])

    def test_an_emulator_that_is_stopped_takes_its_panel_along(self):
        with self.emulator("trio", "--panel") as t:
            t.shows("ABSOLUTE")
            os.kill(t.child(), signal.SIGTERM)
            t.ended(0)
        self.assertEqual(os.listdir(self.directory), [])

    def test_an_emulator_that_is_told_to_quit(self):
        control = os.path.join(self.directory, "control")
        with self.emulator("trio", "--panel", "--control", control) as t:
            t.shows("ABSOLUTE")
            t.keys(":", *"quit", "Enter")
            self.assertIn("the emulator has ended", t.ended(1))
        self.assertEqual(os.listdir(self.directory), [])

    def test_an_emulator_that_is_killed(self):
        with self.emulator("trio", "--panel") as t:
            t.shows("ABSOLUTE")
            panel = self.panel_of(t)
            os.kill(t.child(), signal.SIGKILL)
            emu.wait_until(lambda: not os.path.exists(f"/proc/{panel}"), "the panel ends by itself")
            emu.wait_until(t.is_left, "it leaves the terminal")

    def test_what_does_not_go_with_it(self):
        status, _, error = emu.outcome("run", "trio", "--panel", "--", "true")
        self.assertEqual(status, 2)
        self.assertIn("--panel is for dryrig-emu trio|mpc|rig", error)
        status, _, error = emu.outcome("trio", "--panel", "--trace", "-")
        self.assertEqual(status, 2)
        self.assertIn("would write over each other", error)
        status, out, error = emu.outcome("trio", "--panel")
        self.assertEqual((status, out), (2, ""))
        self.assertIn("a terminal is needed", error)


emu.main()
