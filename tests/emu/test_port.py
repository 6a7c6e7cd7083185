"""The port of dryrig-emu: raw, opened and closed by anybody at any time, never in the way of the controller."""
import os
import signal
import subprocess
import termios
import threading
import time
import unittest

import emu
from emu import ACTIVE, Emulator, Port, point


class Raw(unittest.TestCase):
    def test_a_plain_open_and_read_sees_every_byte_value(self):
        with Emulator("mpc", "--pace", "off", "--speedup", "1000") as e, Port(e.path) as port:
            for low in range(0, 256, 3):
                for shape in ((low, (low + 1) % 256, (low + 2) % 256), (low, low, low)):
                    frame = point(*(byte << 8 | byte for byte in shape))
                    self.assertEqual(port.ask(b"M" + frame, 1), b"\r")
                    self.assertEqual(port.ask(b"C", 14), b"\x01" + frame + b"\r")
            self.assertTrue(port.nothing_more(ACTIVE))

    def test_a_shell_without_stty_reads_exactly_six_bytes(self):
        with Emulator("mpc") as e:
            script = f"exec 3<>{e.path}; printf U >&3; head -c 6 <&3 | od -An -tx1; read -t 0.2 -n 1 more <&3; echo more $more"
            said = subprocess.run(["bash", "-c", script], capture_output=True, timeout=emu.LIMIT_S, check=True).stdout
            self.assertEqual(said.decode().split(), ["02", "01", "01", "00", "00", "0d", "more"])

    def test_whatever_a_host_leaves_the_next_one_finds_it_raw(self):
        with Emulator("mpc", "--pace", "off") as e:
            with Port(e.path) as port:
                raw = termios.tcgetattr(port.fd)
            for change in ("cooked", "slow", "seven", "flow", "min0"):
                with Port(e.path) as port:
                    iflag, oflag, cflag, lflag, ispeed, ospeed, cc = termios.tcgetattr(port.fd)
                    cc = list(cc)
                    if change == "cooked":
                        iflag |= termios.ICRNL | termios.IXON | termios.ISTRIP
                        oflag |= termios.OPOST | termios.ONLCR
                        lflag |= termios.ICANON | termios.ECHO | termios.ISIG
                    elif change == "slow":
                        ispeed = ospeed = termios.B300
                    elif change == "seven":
                        cflag = cflag & ~termios.CSIZE | termios.CS7 | termios.PARENB | termios.CSTOPB
                    elif change == "flow":
                        iflag |= termios.IXON | termios.IXOFF | termios.IXANY
                        cflag |= termios.CRTSCTS
                    else:
                        cc[termios.VMIN], cc[termios.VTIME] = 0, 7
                    termios.tcsetattr(port.fd, termios.TCSANOW, [iflag, oflag, cflag, lflag, ispeed, ospeed, cc])
                self.reopened_raw(e, raw, change)

    def reopened_raw(self, e, raw, change):
        # The last close is noticed a moment later; a settled emulator has nothing more to do.
        def is_raw():
            with Port(e.path) as port:
                return termios.tcgetattr(port.fd) == raw
        emu.wait_until(is_raw, f"raw again after {change}")
        with Port(e.path) as port:
            self.assertEqual(port.ask(*self.counted(ACTIVE)), ACTIVE[1])

    @staticmethod
    def counted(answered):
        return answered[0], len(answered[1])

    def test_a_host_with_cooked_settings_gets_what_it_asked_for(self):
        with Emulator("mpc", "--pace", "off") as e, Port(e.path) as port:
            settings = termios.tcgetattr(port.fd)
            settings[0] |= termios.ICRNL
            termios.tcsetattr(port.fd, termios.TCSANOW, settings)
            self.assertEqual(port.ask(b"\x03", 1), b"\n")


class OpenAndClose(unittest.TestCase):
    def test_any_number_of_times(self):
        with Emulator("mpc", "--pace", "off") as e:
            for _ in range(200):
                with Port(e.path) as port:
                    self.assertEqual(port.ask(b"K", 4), ACTIVE[1])

    def test_several_readers_in_turn_and_at_once(self):
        with Emulator("mpc", "--pace", "off") as e:
            first = Port(e.path)
            second = Port(e.path)
            self.assertEqual(first.ask(b"K", 4), ACTIVE[1])
            first.close()
            for _ in range(20):  # others come and go while one stays
                Port(e.path).close()
                self.assertEqual(second.ask(b"K", 4), ACTIVE[1])
            second.close()
            with Port(e.path) as third:
                self.assertEqual(third.ask(b"K", 4), ACTIVE[1])

    def test_two_ends_of_one_host(self):
        with Emulator("mpc", "--pace", "off") as e:
            for _ in range(50):  # opened and closed in quick succession, as a shell's <PTY >PTY does
                reader = os.open(e.path, os.O_RDONLY | os.O_NOCTTY)
                writer = os.open(e.path, os.O_WRONLY | os.O_NOCTTY)
                os.write(writer, b"K")
                os.close(writer)
                got = b""
                while len(got) < 4:
                    got += os.read(reader, 4)
                self.assertEqual(got, ACTIVE[1])
                os.close(reader)

    def test_what_was_not_read_is_gone_for_the_next(self):
        with Emulator("mpc", "--pace", "off", "--trace", "-") as e:
            for _ in range(3):
                with Port(e.path) as port:
                    port.send(b"U")
                    emu.wait_until(lambda: port.waiting() == 6, "the answer")  # pylint: disable=cell-var-from-loop
                e.wait_for(b"nobody has the port open any more")
                with Port(e.path) as port:
                    self.assertEqual(port.ask(b"K", 4), ACTIVE[1])
                e.wait_for(b"nobody has the port open any more")

    def test_a_host_that_closes_and_opens_at_once_is_answered(self):
        # Whether it still sees what it had not read depends on who is quicker, the kernel does not tell before.
        with Emulator("mpc", "--pace", "off") as e:
            for _ in range(100):
                with Port(e.path) as port:
                    port.send(b"U")
                with Port(e.path) as port:
                    port.send(b"K")
                    got = b""
                    while not got.endswith(ACTIVE[1]):
                        more = port.receive(1)
                        self.assertNotEqual(more, b"", got)
                        got += more
                    self.assertLessEqual(len(got), 6 + 4)

    def test_what_was_sent_before_closing_arrives_and_its_answer_goes_nowhere(self):
        for pace in ("on", "off"):
            with Emulator("mpc", "--pace", pace, "--speedup", "1000", "--trace", "-") as e:
                with Port(e.path) as port:
                    port.send(b"M" + point(0x3456, 0, 0))
                    self.assertEqual(port.receive(1), b"\r")
                with Port(e.path) as port:
                    port.send(b"M" + point(0x1234, 0, 0))
                e.wait_for(b"arrived at X 291.25 um (4,660 steps)")  # and nobody was there
                with Port(e.path) as port:
                    self.assertEqual(port.ask(b"C", 14), b"\x01" + point(0x1234, 0, 0) + b"\r")
                    self.assertTrue(port.nothing_more(ACTIVE))

    def test_the_hosts_end_hangs_up_when_the_emulator_ends(self):
        e = Emulator("mpc")
        with Port(e.path) as port:
            self.assertEqual(e.stop(), 0)
            try:
                self.assertEqual(os.read(port.fd, 1), b"")
            except OSError:
                pass
            self.assertFalse(os.path.exists(e.path))


class HostThatDoesNotRead(unittest.TestCase):
    def test_holds_nobody_up_and_loses_no_state(self):
        with Emulator("mpc", "--pace", "off", "--speedup", "100") as e:
            with Port(e.path) as port:
                for _ in range(100):  # 140,000 bytes of answers
                    port.send(b"C" * 100)
                port.send(b"M" + point(16000, 0, 0))
                e.wait_for(b"does not read")
                # It goes on: another host's position query after the move has its answer when the first has given up.
                termios.tcflush(port.fd, termios.TCIFLUSH)
            with Port(e.path) as port:
                def has_arrived():  # behind the answers to what the first has sent
                    termios.tcflush(port.fd, termios.TCIFLUSH)
                    port.send(b"C")
                    return port.receive(14, 1.0) == b"\x01" + point(16000, 0, 0) + b"\r"
                emu.wait_until(has_arrived, "the move's end")
            self.assertTrue(e.is_idle())

    def test_gets_whole_answers_when_it_reads_at_last(self):
        with Emulator("mpc", "--pace", "off") as e, Port(e.path) as port:
            for _ in range(100):
                port.send(b"C" * 100)
            e.wait_for(b"does not read")
            answer = b"\x01" + point(0, 0, 0) + b"\r"
            got = port.receive(17000)
            self.assertEqual(len(got), 17000)
            while not got.endswith(ACTIVE[1]):  # the answer to this one may be among those that are lost
                port.send(ACTIVE[0])
                got += port.receive(10000 * 14, 1.0)
            answers, rest = got.split(ACTIVE[1], 1)
            self.assertEqual(answers, answer * (len(answers) // 14))
            self.assertLess(len(answers), 10000 * 14)
            self.assertEqual(rest.replace(ACTIVE[1], b""), b"")

    def test_a_slow_reader_loses_nothing(self):
        with Emulator("mpc", "--pace", "off") as e, Port(e.path) as port:
            writer = threading.Thread(target=port.send, args=(b"C" * 2000,))
            writer.start()
            got = b"".join(port.receive(7) for _ in range(4000))
            writer.join()
            self.assertEqual(got, (b"\x01" + point(0, 0, 0) + b"\r") * 2000)


class Quiet(unittest.TestCase):
    def test_idle_costs_nothing_whether_opened_or_not(self):
        for paced in ("on", "off"):
            with Emulator("mpc", "--pace", paced) as e:
                self.assertTrue(e.is_idle(), "before it was opened")
                port = Port(e.path)
                self.assertTrue(e.is_idle(), "open")
                self.assertEqual(port.ask(b"K", 4), ACTIVE[1])
                self.assertTrue(e.is_idle(), "after a command")
                port.send(b"M" + point(400000, 0, 0))  # 8 s: nothing to do until it ends
                self.assertTrue(e.is_idle(), "during a move")
                port.send(b"C" * 100)  # kept, and lost, behind the move
                self.assertTrue(e.is_idle(), "with commands that wait")
                port.close()
                self.assertTrue(e.is_idle(), "closed")

    def test_idle_with_a_host_that_does_not_read(self):
        with Emulator("mpc", "--pace", "off") as e, Port(e.path) as port:
            port.send(b"C" * 5000)
            self.assertTrue(e.is_idle())


class Signals(unittest.TestCase):
    def test_each_ends_it_well(self):
        for how in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            with emu.directory() as d:
                link = os.path.join(d, "rig")
                e = Emulator("trio", "--link", link)
                self.assertEqual(os.readlink(link), e.path)
                with Port(link) as port:
                    self.assertEqual(len(port.ask(b"c", 14)), 14)
                self.assertEqual(e.stop(how), 0)
                self.assertEqual(os.listdir(d), [])
                self.assertEqual(e.out, "")  # one line and no more

    def test_sigint_ends_a_background_job_too(self):
        ignore = lambda: signal.signal(signal.SIGINT, signal.SIG_IGN)
        e = Emulator("mpc", preexec_fn=ignore)
        self.assertEqual(e.stop(signal.SIGINT), 0)

    def test_nohup_is_respected(self):
        ignore = lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN)
        with Emulator("mpc", preexec_fn=ignore) as e:
            e.process.send_signal(signal.SIGHUP)
            with Port(e.path) as port:
                self.assertEqual(port.ask(b"K", 4), ACTIVE[1])


class StandardStreams(unittest.TestCase):
    def test_closed_ones_do_not_get_mixed_up_with_the_port(self):
        with emu.directory() as d:
            link = os.path.join(d, "rig")
            script = f'"{emu.PROGRAM}" mpc --link {link} <&- >&- 2>&- & echo $!'
            pid = int(subprocess.run(["bash", "-c", script], capture_output=True, check=True).stdout)
            try:
                emu.wait_until(lambda: os.path.exists(link), "the link")
                with Port(link) as port:
                    self.assertEqual(port.ask(b"K", 4), ACTIVE[1])
                    self.assertTrue(port.nothing_more(ACTIVE))
            finally:
                os.kill(pid, signal.SIGTERM)
            emu.wait_until(lambda: not os.path.lexists(link), "the link is gone")

    def test_a_reader_of_the_ready_line_that_is_gone_is_an_error(self):
        with emu.directory() as d:
            link = os.path.join(d, "rig")
            reading, writing = os.pipe()
            os.close(reading)
            process = emu.start("mpc", "--link", link, stdout=writing)
            os.close(writing)
            error = process.communicate(timeout=emu.LIMIT_S)[1].decode()
            self.assertEqual(process.returncode, 1)
            self.assertIn("ready", error)
            self.assertEqual(os.listdir(d), [])

    def test_head_may_take_the_ready_line_and_go(self):
        with Emulator("mpc") as e:
            e.process.stdout.close()
            e.process.stdout = None
            with Port(e.path) as port:
                self.assertEqual(port.ask(b"K", 4), ACTIVE[1])


if __name__ == "__main__":
    emu.main()
