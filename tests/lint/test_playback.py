"""replay --to-host: a recorded controller, played to host programs; and --record to a pipe that nobody reads."""
import os
import re
import select
import signal
import subprocess
import tempfile
import time
import unittest

import emu
import realtime

EMULATOR = os.environ["DRYRIG_EMU"]
DRYRIG = os.environ["DRYRIG"]
LIMIT_S = 60

# [M] table 9: C has 14 bytes, M one CR; K has 4.
AT_0, AT_1 = "01" + " 00" * 12 + " 0D", "01" + " 10 00 00 00" * 3 + " 0D"
MOVE = "4D" + " 10 00 00 00" * 3
RECORDING = f"""dryrig-recording 1
set mpc controller mpc
set mpc firmware 3.21
set mpc device MP-225
0.000000 0.000000 mpc - the port has been opened
0.010000 0.010000 mpc > 43
0.012000 0.012000 mpc < {AT_0}
0.050000 0.050000 mpc > {MOVE}
0.250000 0.250000 mpc < 0D
0.300000 0.300000 mpc > 43
0.302000 0.302000 mpc < {AT_1}
0.303000 0.303000 mpc ! 00
0.310000 0.310000 mpc - nobody has the port open any more
"""


def raw(text):
    return bytes.fromhex(text)


class Program:
    """An emulator that says `ready`."""

    def __init__(self, *args):
        self.process = emu.start(*args)
        line = self.process.stdout.readline().decode()
        self.port = line.split()[1] if line.startswith("ready ") else None

    def end(self, wanted_signal=None):
        if wanted_signal is not None:
            self.process.send_signal(wanted_signal)
        try:
            _, err = self.process.communicate(timeout=LIMIT_S)
        finally:
            self.process.kill()
            self.process.wait()
        return self.process.returncode, err.decode()


class Host:
    def __init__(self, port):
        self.fd = os.open(port, os.O_RDWR | os.O_NOCTTY)

    def ask(self, request, count):
        os.write(self.fd, raw(request))
        return self.read(count)

    def read(self, count):
        got = b""
        while len(got) < count and select.select([self.fd], [], [], LIMIT_S)[0]:
            got += os.read(self.fd, count - len(got))
        return got

    def close(self):
        os.close(self.fd)


class Playback(realtime.TestCase):
    def setUp(self):
        self.where = tempfile.TemporaryDirectory()
        self.path = os.path.join(self.where.name, "line.rec")
        self.write(RECORDING)
        self.programs = []

    def tearDown(self):
        for program in self.programs:
            if program.process.poll() is None:
                program.end(signal.SIGKILL)
        self.where.cleanup()

    def write(self, text):
        with open(self.path, "w", encoding="ascii") as file:
            file.write(text)

    def start(self, *options):
        self.programs.append(Program("replay", "--to-host", self.path, *options))
        self.assertIsNotNone(self.programs[-1].port)
        return self.programs[-1]

    def talk(self, *exchanges, options=("--clock", "jump")):
        program = self.start(*options)
        host = Host(program.port)
        for request, answer in exchanges:
            self.assertEqual(raw(answer), host.ask(request, len(raw(answer))))
        host.close()
        return program

    def test_the_recorded_answers_follow_the_recorded_requests(self):
        program = self.talk(("43", AT_0), (MOVE, "0D"), ("43", AT_1))
        status, err = program.end()
        self.assertEqual(0, status, err)
        self.assertIn("mpc: 0 of the host's 3 requests differ, 0 of the recording were not made.", err)

    def test_not_before_their_time(self):
        for options, least_s in (((), 0.2), (("--speedup", "4"), 0.05)):
            with self.subTest(options):
                program = self.start(*options)
                host = Host(program.port)
                host.ask("43", 14)
                began = time.monotonic()
                self.assertEqual(b"\r", host.ask(MOVE, 1))
                self.assertGreaterEqual(time.monotonic() - began, least_s)
                host.ask("43", 14)
                host.close()
                self.assertEqual(0, program.end()[0])

    def test_several_hosts_one_after_the_other_through_a_link(self):
        link = os.path.join(self.where.name, "rig")
        program = self.start("--link", link, "--clock", "jump")
        for request, answer in (("43", AT_0), (MOVE, "0D"), ("43", AT_1)):
            host = Host(link)
            self.assertEqual(raw(answer), host.ask(request, len(raw(answer))))
            host.close()
        self.assertEqual(0, program.end()[0])
        self.assertFalse(os.path.lexists(link))

    def test_bytes_that_come_early_wait_for_their_turn(self):
        program = self.start("--clock", "jump")
        host = Host(program.port)
        self.assertEqual(raw(AT_0 + "0D" + AT_1), host.ask("43" + MOVE + "43", 29))
        host.close()
        self.assertEqual(0, program.end()[0])

    def test_the_same_command_with_other_values(self):
        other = MOVE.replace("10", "20")
        status, err = self.talk(("43", AT_0), (other, "0D"), ("43", AT_1)).end()
        self.assertEqual(1, status)
        self.assertIn("line.rec:8, 0.050000 s, byte 2 of the host: another request than recorded", err)
        self.assertRegex(err, rf"recorded:  {MOVE}  .*X 1\.0 um \(16 steps\)")
        self.assertRegex(err, rf"the host:  {other}  .*X 2\.0 um \(32 steps\)")
        self.assertIn("mpc: 1 of the host's 3 requests differ, 0 of the recording were not made.", err)

    def test_left_out(self):
        text = RECORDING.replace("> 43\n0.302", "> 4B\n0.302").replace("< " + AT_1, "< 01 21 03 0D")
        self.write(text)
        status, err = self.talk(("43", AT_0), ("4B", "01 21 03 0D")).end()
        self.assertEqual(1, status)
        self.assertIn("it comes later in the recording, which goes on there", err)
        self.assertIn("mpc: 1 of the host's 2 requests differ, 1 of the recording was not made.", err)

    def test_asked_once_more(self):
        status, err = self.talk(("43", AT_0), ("43", AT_0), (MOVE, "0D"), ("43", AT_1), ("43", AT_1)).end()
        self.assertEqual(1, status)
        self.assertIn("recorded:  nothing more", err)
        self.assertIn("mpc: 2 of the host's 5 requests differ, 0 of the recording were not made.", err)

    def test_what_was_never_recorded_gets_no_answer(self):
        status, err = self.talk(("43", AT_0), ("4B EE", ""), (MOVE, "0D"), ("43", AT_1)).end()
        self.assertEqual(1, status)
        self.assertIn("byte 2 of the host", err)
        self.assertIn("byte 3 of the host", err)
        self.assertIn("it is not in the rest of the recording: no answer", err)
        self.assertIn("mpc: 2 of the host's 5 requests differ", err)

    def test_a_signal_ends_it_and_what_is_missing_is_told(self):
        link = os.path.join(self.where.name, "rig")
        for which in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            program = self.start("--link", link)
            host = Host(link)
            self.assertEqual(raw(AT_0), host.ask("43", 14))
            status, err = program.end(which)
            host.close()
            self.assertEqual(1, status)
            self.assertIn("mpc: 0 of the host's 1 requests differ, 2 of the recording were not made.", err)
            self.assertFalse(os.path.lexists(link))

    def test_what_cannot_be_played(self):
        two = RECORDING + "0.400000 0.400000 trio > 63\n"
        for text, wanted in (("", ":0: it is empty"), (two, ":14: a second controller"), (RECORDING[:-4], ":13: the line is torn"),
                             ("dryrig-recording 1\n", "no controller"), (RECORDING.replace("er mpc", "er x"), "trio or mpc"),
                             ("dryrig-recording 1\n0.000000 0.000000 a > 43\n", ":2: which controller?")):
            self.write(text)
            program = Program("replay", "--to-host", self.path)
            status, err = program.end()
            self.assertEqual((2, None), (status, program.port))
            self.assertIn(wanted, err)
        self.write(RECORDING)
        for options, wanted in ((("replay", "--to-host", "/nowhere/to.be"), 2), (("mpc", "--to-host"), 2),
                                (("replay", "--to-host", self.path, "--clock", "step"), 2),
                                (("replay", "--to-host", self.path, "--link", "/nowhere/to/be"), 1)):
            status, err = Program(*options).end()
            self.assertEqual(wanted, status)
            self.assertTrue(err.startswith("dryrig-emu: "), err)

    def test_the_command_line_does_not_see_a_difference(self):
        commands = {"mpc": ["info", "move 1000 2000 500", "line 1010 2010 510 --speed 15 --stream", "position", "select 2"],
                    "trio": ["info", "move 1010 990 1000", "angle 45", "position"]}
        for kind, recorder in (("mpc", "emulator"), ("trio", "emulator"), ("mpc", "dryrig")):
            with self.subTest(f"{kind}, recorded by {recorder}"):
                # dryrig keeps one command in a recording
                wanted = commands[kind] if recorder == "emulator" else ["line 10 20 30 --speed 15 --stream"]
                begin = [DRYRIG, "-c", kind, "-s", "MP-225" if kind == "mpc" else "MP-845"]
                link = os.path.join(self.where.name, "rig")
                by_emulator = ["--record", self.path] if recorder == "emulator" else []
                by_dryrig = ["--record", self.path] if recorder == "dryrig" else []
                emulator = Program(kind, "--link", link, *by_emulator)
                self.programs.append(emulator)
                first = [self.call(begin + by_dryrig + ["-p", link] + words.split()) for words in wanted]
                self.assertEqual(0, emulator.end(signal.SIGTERM)[0])
                program = self.start("--link", link)
                second = [self.call(begin + ["-p", link] + words.split()) for words in wanted]
                status, err = program.end()
                self.assertEqual(0, status, err)
                self.assertEqual(first, second)
                self.assertRegex(err, rf"{kind}: 0 of the host's \d+ requests differ, 0 of the recording were not made")

    def call(self, words):
        done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, timeout=LIMIT_S, check=False)
        self.assertEqual((0, b""), (done.returncode, done.stderr), words)
        return re.sub(rb"[\d.]+ (ms|s)\b", b"T", done.stdout)


class Pipes(realtime.TestCase):
    def test_a_recording_that_nobody_reads_holds_nobody_up(self):
        with tempfile.TemporaryDirectory() as where:
            pipe = os.path.join(where, "pipe")
            os.mkfifo(pipe)
            program = Program("mpc", "--clock", "jump", "--record", pipe)  # begins without a reader
            host = Host(program.port)
            for _ in range(1500):  # each is 100 bytes and more; a pipe holds 65,536
                self.assertEqual(14, len(host.ask("43", 14)))
            reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
            kept = os.read(reader, 1 << 20)
            self.assertTrue(kept.startswith(b"dryrig-recording 1\nset mpc controller mpc\n"))
            self.assertTrue(kept.endswith(b"\n"))
            self.assertEqual(14, len(host.ask("43", 14)))  # there is room again
            select.select([reader], [], [], LIMIT_S)
            self.assertRegex(os.read(reader, 1 << 20).decode(), r"^\S+ \S+ mpc - \d+ lines are lost here, nobody took them\n")
            os.close(reader)
            host.close()
            status, err = program.end(signal.SIGTERM)
            self.assertEqual(0, status)
            self.assertEqual(1, err.count("nobody reads the recording"))

    def test_it_ends_by_a_signal_while_nobody_reads(self):
        with tempfile.TemporaryDirectory() as where:
            pipe = os.path.join(where, "pipe")
            os.mkfifo(pipe)
            program = Program("mpc", "--clock", "jump", "--record", pipe)
            host = Host(program.port)
            for _ in range(1000):
                self.assertEqual(14, len(host.ask("43", 14)))
            host.close()
            status, err = program.end(signal.SIGTERM)
            self.assertEqual(0, status)
            self.assertRegex(err, r"pipe is incomplete: nobody took its last \d+ lines")


    def test_dryrig_does_not_wait_for_a_reader_with_a_controller_in_its_hand(self):
        with tempfile.TemporaryDirectory() as where:
            pipe = os.path.join(where, "pipe")
            os.mkfifo(pipe)
            words = [DRYRIG, "--port", "/dev/null", "--controller", "mpc", "--record", pipe, "info"]
            done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, timeout=LIMIT_S, check=False)
            self.assertEqual((2, b""), (done.returncode, done.stdout))
            self.assertIn(b"nobody reads this pipe", done.stderr)


class Small(realtime.TestCase):
    def test_a_wedge_is_told_once(self):
        program = Program("mpc", "--quirks", "s-needs-pause")
        host = Host(program.port)
        os.write(host.fd, b"S\x0f" + bytes(12) + b"C" * 20)
        while b"mpc hangs" not in program.process.stderr.readline():
            self.assertIsNone(program.process.poll())
        os.write(host.fd, b"C" * 20)
        self.assertEqual([], select.select([host.fd], [], [], 0.1)[0])
        host.close()
        self.assertNotIn("hangs", program.end(signal.SIGTERM)[1])

    def test_short_help(self):
        texts = [subprocess.run([EMULATOR, option], capture_output=True, timeout=LIMIT_S, check=True).stdout
                 for option in ("-h", "--help")]
        self.assertEqual(texts[0], texts[1])
        self.assertIn(b"--to-host", texts[0])


if __name__ == "__main__":
    unittest.main()
