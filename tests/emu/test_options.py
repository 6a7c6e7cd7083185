"""The command line of dryrig-emu: what every option sets, and what is said about wrong ones."""
import os
import select
import struct
import unittest

import emu
from emu import Emulator, Port, outcome, point

CR = b"\r"


class Right(unittest.TestCase):
    def ask(self, args, request, count):
        with Emulator(*args) as e, Port(e.path) as port:
            return port.ask(request, count)

    def test_defaults(self):
        self.assertEqual(self.ask(["trio"], b"c", 14), point(10667, 10667, 10667) + b"\x1e" + CR)
        self.assertEqual(self.ask(["mpc"], b"U", 6), b"\x02\x01\x01\x00\x00" + CR)
        self.assertEqual(self.ask(["mpc"], b"K", 4), b"\x01\x21\x03" + CR)
        self.assertEqual(self.ask(["mpc"], b"C", 14), b"\x01" + point(0, 0, 0) + CR)

    def test_names_ignore_case_and_options_come_in_any_order(self):
        self.assertEqual(self.ask(["--device", "mp-845", "MPC", "--device=Mp-285", "--device", "NONE"], b"U", 6),
                         b"\x02\x01\x01\x00\x00" + CR)

    def test_if_any_device_is_named_the_other_ports_are_empty(self):
        self.assertEqual(self.ask(["mpc", "--device", "none", "--device", "MP-265"], b"U", 6), b"\x01\x00\x01\x00\x00" + CR)
        self.assertEqual(self.ask(["mpc"] + ["--device", "MT-800"] * 4, b"U", 6), b"\x04\x01\x01\x01\x01" + CR)

    def test_firmware(self):
        self.assertEqual(self.ask(["mpc", "--firmware", "3.19"], b"K", 4), b"\x01\x19\x03" + CR)
        self.assertEqual(self.ask(["mpc", "--firmware", "2.50"], b"K", 2), b"\x01" + CR)

    def test_positions_in_steps_and_in_microns(self):
        for text, steps in (("1,2,3", (1, 2, 3)), ("100um,200um,300um", (1600, 3200, 4800)), ("100,200,300um", (1600, 3200, 4800)),
                            ("0.0625um,0.09um,0.1um", (1, 1, 2)), ("25000UM,0um,12.5um", (400000, 0, 200)), ("400000,0,0", (400000, 0, 0))):
            self.assertEqual(self.ask(["mpc", "--position", text], b"C", 14), b"\x01" + point(*steps) + CR, text)
        # The same microns are other steps on another controller, where an MP-845 has 10.667 a um.
        self.assertEqual(self.ask(["trio", "--position", "100um,0um,25000um"], b"c", 14), point(1067, 0, 266667) + b"\x1e" + CR)

    def test_positions_repeat_for_the_devices_that_are_connected(self):
        args = ["mpc", "--device", "none", "--device", "MP-225", "--device", "none", "--device", "MP-285", "--position", "1,2,3",
                "--position", "4,5,6"]
        with Emulator(*args) as e, Port(e.path) as port:
            self.assertEqual(port.ask(b"C", 14), b"\x02" + point(1, 2, 3) + CR)
            self.assertEqual(port.ask(b"I\x04", 2), b"\x04" + CR)
            self.assertEqual(port.ask(b"C", 14), b"\x04" + point(4, 5, 6) + CR)

    def test_angle_of_a_trio(self):
        for angle in (0, 45, 90):
            self.assertEqual(self.ask(["trio", "--angle", str(angle)], b"c", 14)[12], angle)

    def test_angle_of_an_mpc_shows_in_the_way_home(self):
        # At half way of the first leg of 'H', Z has gone as far as X where the diagonal is 45 degrees; less where it is less.
        for text, is_steep in (("29", False), ("29less", False), ("29-less", False), ("29 less", False), ("29more", True), ("7", False),
                               ("45", None), ("11MORE", True)):
            with Emulator("mpc", "--angle", text, "--position", "200000,0,200000", "--clock", "jump", "--do",
                          "on H in 500ms press stop") as e, Port(e.path) as port:
                self.assertEqual(port.ask(b"H", 1), CR)
                x, _, z = struct.unpack("<III", port.ask(b"C", 14)[1:13])
                self.assertLess(x + z, 400000)
                if is_steep is None:
                    self.assertEqual(x, z)
                else:
                    self.assertEqual(is_steep, 200000 - z > 200000 - x, text)

    def test_what_it_says_to_people_is_on_stderr(self):
        with Emulator("mpc", "--device", "MP-845", "--quirks", "observed") as e:
            pass
        self.assertEqual(e.out, "")
        for words in ("MPC-200", "3.21", "not affiliated", "MP-845", "small-move-silent",
                      f"dryrig --port {e.path} --controller mpc --stage MP-845 position"):
            self.assertIn(words, e.err)

    def test_help_and_version(self):
        status, out, error = outcome("--help")
        self.assertEqual((status, error), (0, ""))
        for option in ("link", "device", "firmware", "position", "home", "work", "angle", "quirks", "pace", "trace", "speedup"):
            self.assertIn(f"--{option}", out)
        status, out, error = outcome("--version")
        self.assertEqual((status, error), (0, ""))
        self.assertRegex(out, r"^dryrig-emu \d+\.\d+\.\d+\n$")


class Wrong(unittest.TestCase):
    def refused(self, args, *words):
        status, out, error = outcome(*args)
        self.assertEqual((status, out), (2, ""), error)
        for word in words:
            self.assertIn(word, error, args)

    def test_controllers(self):
        self.refused([], "trio", "mpc")
        self.refused(["mp285"], "mp285", "trio", "mpc")
        self.refused(["mpc", "trio"], "trio")
        self.refused(["mpc", "--no-such"], "no-such")

    def test_devices(self):
        self.refused(["mpc", "--device", "MP-999"], "MP-999", "MP-225", "MT-800", "none")
        self.refused(["trio", "--device", "MP-225"], "MP-225", "MP-845")
        self.refused(["trio", "--device", "none"], "none")
        self.refused(["trio", "--device", "MP-845", "--device", "MP-285"], "MP-285", "one")
        self.refused(["mpc"] + ["--device", "MP-225"] * 5, "4")
        self.refused(["mpc", "--device", "MP-845", "--firmware", "3.16"], "MP-845", "3.19", "3.16")
        self.refused(["mpc", "--device", "MP-865", "--firmware", "3.19"], "MP-865", "3.21")
        self.refused(["mpc", "--device", "MOM"], "MOM", "3.13", "3.16")
        self.refused(["mpc", "--firmware", "3.16", "--device", "none", "--device", "MOM"], "MOM", "port")

    def test_firmware(self):
        for text in ("3", "3.2", "three", "3.211", "", "0.99", "3,21"):
            self.refused(["mpc", "--firmware", text], "--firmware")
        self.refused(["mpc", "--firmware", "3.22"], "1.00 to 3.21")
        self.refused(["trio", "--firmware", "3.21"], "1.00 to 3.12")

    def test_positions(self):
        for text in ("1,2", "1,2,3,4", "1,2,", "a,b,c", "1;2;3", "-1,0,0", "1.5,0,0", "0x10,0,0", "1um,2,3", "99999999999,0,0", "", "1,2,3mm"):
            self.refused(["mpc", "--position", text], "--position", text)
        self.refused(["mpc", "--position", "400001,0,0"], "X", "400,000", "25,000")
        self.refused(["mpc", "--position", "0,0,25001um"], "Z", "400,000")
        self.refused(["trio", "--work", "0,266668,0"], "--work", "Y", "266,667")
        self.refused(["trio", "--home", "0,266668,0"], "--home", "Y", "266,667")
        self.refused(["mpc", "--home", "0,0,0"], "trio")
        self.refused(["mpc"] + ["--position", "1,1,1"] * 3, "2 devices")
        self.refused(["mpc", "--device", "none", "--position", "1,1,1"], "0 devices")

    def test_angles(self):
        for text in ("91", "-1", "30.5", "29more", ""):
            self.refused(["trio", "--angle", text], "--angle", "90")
        for text in ("30", "7more", "45more", "45less", "90", "29both", "", "more"):
            self.refused(["mpc", "--angle", text], "--angle", "29", "more")

    def test_the_rest(self):
        self.refused(["mpc", "--quirks", "positon-13"], "positon-13", "position-13", "observed", "documented")
        self.refused(["trio", "--quirks", "position-13"], "MPC-200")
        self.refused(["mpc", "--pace", "fast"], "fast", "on", "off")
        for text in ("0", "1001", "2.5", "x", "", "-1"):
            self.refused(["mpc", "--speedup", text], "1", "1000")
        self.refused(["mpc", "--link", ""], "--link")
        self.refused(["mpc", "--pace", "on", "--pace", "off"], "twice")


class Trace(unittest.TestCase):
    def test_tells_commands_replies_streams_and_events(self):
        with emu.directory() as d:
            path = os.path.join(d, "trace")
            with Emulator("mpc", "--trace", path, "--pace", "off", "--speedup", "100") as e, Port(e.path) as port:
                self.assertEqual(port.ask(b"C", 14)[:1], b"\x01")
                self.assertEqual(port.ask(b"O", 1), CR)
                self.assertEqual(len(port.ask(b"S\x0f" + point(1600, 0, 0), 1201)), 1201)
                self.assertEqual(port.ask(b"K", 4)[:1], b"\x01")
            with open(path, encoding="ascii") as file:
                lines = file.read().splitlines()
        for line in lines:
            self.assertRegex(line, r"^ *\d+\.\d{6} [<>-] \S")
        said = "\n".join(lines)
        self.assertRegex(said, r"> 43 +\S.*\n.*< 01 00 00 00 00 00 00 00 00 00 00 00 00 0D +\S")
        self.assertRegex(said, r"> 53 0F 40 06 00 00 .*1,600")
        self.assertRegex(said, r"\n.*- .*100\.0 um.*\n.*< FF FF FF 40 06 00 .* 100 streamed positions.*\n.*arrived.*\n.*< 0D ")
        self.assertLess(len(lines), 20)  # the stream is one line

    def test_a_full_disk_is_said_once_and_stops_nothing(self):
        e = Emulator("mpc", "--trace", "/dev/full", "--pace", "off")
        with Port(e.path) as port:
            for _ in range(50):
                self.assertEqual(port.ask(b"K", 4), emu.ACTIVE[1])
        self.assertEqual(e.stop(), 1)
        self.assertEqual(e.err.count("/dev/full"), 1)

    def test_stderr_that_is_gone_stops_nothing(self):
        with Emulator("mpc", "--trace", "-", "--pace", "off") as e, Port(e.path) as port:
            e.process.stderr.close()
            e.process.stderr = None
            for _ in range(50):
                self.assertEqual(port.ask(b"K", 4), emu.ACTIVE[1])

    def test_a_trace_that_nobody_reads_stops_nothing(self):
        for name, told in (("trace", rb"- \d+ lines of the trace are lost, nobody took them\n.*> 4B"),
                           ("trace.jsonl", rb'{"lost_lines":\d+}\n{.*"4B"')):
            with self.subTest(name), emu.directory() as d:
                path = os.path.join(d, name)
                os.mkfifo(path)
                with Emulator("mpc", "--trace", path, "--pace", "off") as e, Port(e.path) as port:  # begins without a reader
                    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
                    self.addCleanup(os.close, reader)
                    for _ in range(2000):  # 140 kB of trace and more; a pipe takes 64
                        self.assertEqual(port.ask(b"K", 4), emu.ACTIVE[1])
                    while select.select([reader], [], [], 0)[0]:
                        os.read(reader, 65536)
                    self.assertEqual(port.ask(b"K", 4), emu.ACTIVE[1])
                    self.assertRegex(os.read(reader, 65536), told)

    def test_a_report_into_a_pipe_waits_for_nobody_at_the_start(self):
        with emu.directory() as d:
            path = os.path.join(d, "lint.json")
            os.mkfifo(path)
            with Emulator("mpc", "--lint-json", path):
                reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
                self.addCleanup(os.close, reader)
            self.assertIn(b'"findings"', os.read(reader, 65536))

    def test_the_trace_shows_what_goes_over_the_wire(self):
        with emu.directory() as d:
            path, socket = os.path.join(d, "trace"), os.path.join(d, "control")
            with Emulator("mpc", "--clock", "jump", "--quirks", "nul-heartbeat,stop-says-i,position-13", "--trace", path,
                          "--control", socket, "--do", "in 120ms press stop") as e, Port(e.path) as port:
                self.assertEqual(port.ask(b"C", 13)[-1:], b"\r")
                self.assertEqual(port.ask(b"\x03", 2), b"I\r")
                self.assertEqual(port.ask(b"M" + emu.point(48000, 0, 0), 2), b"\0I")  # a NUL at 100 ms, STOP at 120
                self.assertEqual(port.ask(b"K", 4), emu.ACTIVE[1])
                self.assertEqual(port.ask(b"M" + emu.point(16, 0, 0), 120)[-1:], b"\r")
            with open(path, encoding="ascii") as file:
                lines = [line.split(maxsplit=2) for line in file]
        self.assertIn("been on for a while", " ".join(lines[0]))
        sent = [words[2] for words in lines if words[1] == "<"]
        self.assertTrue(sent[0].startswith("00 00 00"), sent)
        self.assertTrue(sent[1].startswith("49 0D "), sent)
        self.assertTrue(sent[2].startswith("00  "), sent)
        self.assertTrue(sent[3].startswith("49  "), sent)
        self.assertTrue(sent[4].startswith("01 21 03 0D "), sent)
        self.assertTrue(sent[-1].startswith("0D "), sent)

    def test_a_trace_that_cannot_be_begun_is_an_error(self):
        status, out, error = outcome("mpc", "--trace", "/no/such/directory/trace")
        self.assertEqual((status, out), (1, ""))
        self.assertIn("/no/such/directory/trace", error)


if __name__ == "__main__":
    emu.main()
