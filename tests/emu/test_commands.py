"""Every command of both controllers through the port of dryrig-emu: exactly the documented bytes, and none after.

Typed from the manuals: TRIO MP-245A quick reference, table 6; MPC-325 quick reference, table 9; and PROTOCOL.md."""
import json
import struct
import time
import unittest

import emu
from ctl import Rehearsal
from emu import Emulator, Port, point

CR = b"\r"
TRIO_START = 10667  # 1,000 um at 0.09375 um a step


class Commands(unittest.TestCase):
    def dialogue(self, args, exchanges):
        """Sends each request and expects its answer; behind the last one nothing comes."""
        with Emulator(*args, "--pace", "off", "--speedup", "1000") as e, Port(e.path) as port:
            for request, answer in exchanges:
                self.assertEqual(port.ask(request, len(answer)), answer, request)
                self.assertEqual(port.waiting(), 0, request)
            self.assertEqual(port.receive(1, 0.05), b"")
            self.assertEqual(port.ask(*self.last(exchanges)), exchanges[-1][1])

    @staticmethod
    def last(exchanges):
        return exchanges[-1][0], len(exchanges[-1][1])

    def test_trio(self):
        def at(x, y, z, angle=30):
            return point(x, y, z) + bytes([angle]) + CR
        home, work = (100, 200, 300), (4000, 5000, 6000)
        self.dialogue(("trio", "--home", "100,200,300", "--work", "4000,5000,6000"), [
            (b"c", at(TRIO_START, TRIO_START, TRIO_START)),
            (b"C", at(TRIO_START, TRIO_START, TRIO_START)),
            (b"h", CR), (b"c", at(*home)),
            (b"w", CR), (b"c", at(*work)),
            (b"H" + point(1, 2, 3), CR), (b"c", at(1, 2, 3)),
            (b"W" + point(13, 10, 3), CR), (b"c", at(13, 10, 3)),  # 0x0D and 0x0A and 0x03 in a coordinate
            (b"h", CR), (b"c", at(*home)),                         # 'H' and 'W' stored nothing
            (b"w", CR), (b"c", at(*work)),
            (b"S\x0f" + point(7, 8, 9), CR), (b"c", at(7, 8, 9)),
            (b"S\x00" + point(8, 8, 9), CR), (b"c", at(8, 8, 9)),
            (b"x" + struct.pack("<I", 70), CR), (b"X" + struct.pack("<I", 71), CR),
            (b"y" + struct.pack("<I", 80), CR), (b"Y" + struct.pack("<I", 81), CR),
            (b"z" + struct.pack("<I", 90), CR), (b"Z" + struct.pack("<I", 91), CR),
            (b"c", at(71, 81, 91)),
            (b"A\x2d", CR), (b"c", at(71, 81, 91, 45)),
            (b"A\x5b", CR), (b"c", at(71, 81, 91, 45)),            # 91 degrees: refused, CR all the same
            (b"\x03", CR),                                          # nothing moves
            (b"R", CR), (b"c", at(TRIO_START, TRIO_START, TRIO_START, 45)),
        ])

    def test_mpc(self):
        def at(drive, x, y, z):
            return bytes([drive]) + point(x, y, z) + CR
        self.dialogue(("mpc", "--device", "MP-225", "--device", "none", "--device", "MP-285", "--work", "800,900,1000"), [
            (b"U", bytes([2, 1, 0, 1, 0]) + CR),
            (b"K", b"\x01\x21\x03" + CR),
            (b"C", at(1, 0, 0, 0)),
            (b"M" + point(13, 10, 3), CR), (b"C", at(1, 13, 10, 3)),
            (b"S\x0f" + point(160, 80, 40), CR), (b"C", at(1, 160, 80, 40)),
            (b"H", CR), (b"C", at(1, 0, 0, 0)),
            (b"Y", CR), (b"C", at(1, 800, 900, 1000)),
            (b"N", CR), (b"C", at(1, 0, 0, 0)),
            (b"I\x03", b"\x03" + CR), (b"K", b"\x03\x21\x03" + CR), (b"C", at(3, 0, 0, 0)),
            (b"I\x02", b"E" + CR), (b"I\x00", b"E" + CR), (b"I\x05", b"E" + CR), (b"I1", b"E" + CR),
            (b"K", b"\x03\x21\x03" + CR),
            (b"I\x01", b"\x01" + CR),
            (b"L\x00", CR), (b"L\x09", CR), (b"L\x0a", CR),
            (b"\x03", CR),
            (b"O", CR),
            (b"S\x0f" + point(64, 16, 0), b"".join(b"\xff\xff\xff" + stream(16 * k, 4 * k, 0) for k in range(1, 5)) + CR),
            (b"F", CR),
            (b"S\x0f" + point(0, 0, 0), CR), (b"C", at(1, 0, 0, 0)),
        ])

    def test_mpc_of_older_firmware(self):
        devices = ("--device", "MP-225", "--device", "MP-285")
        self.dialogue(("mpc", *devices, "--firmware", "1.00"), [
            (b"A", b"\x02" + CR), (b"K", b"\x01" + CR), (b"I\x02", CR), (b"K", b"\x02" + CR), (b"I\x04", CR), (b"K", b"\x02" + CR),
            (b"N", CR), (b"C", b"\x02" + point(200000, 200000, 200000) + CR)])
        self.dialogue(("mpc", *devices, "--firmware", "1.06"), [
            (b"A", b"\x02" + CR), (b"I\x02", b"\x02" + CR), (b"I\x04", b"E" + CR), (b"K", b"\x02" + CR),
            (b"N", CR), (b"C", b"\x02" + point(0, 0, 0) + CR)])

    def test_nothing_answers_what_is_no_command(self):
        with Emulator("mpc", "--pace", "off") as e, Port(e.path) as port:
            port.send(bytes(set(range(256)) - set(b"ACFHIKLMNOSUY\x03")))
            self.assertEqual(port.ask(b"K", 4), emu.ACTIVE[1])
            self.assertEqual(port.receive(1, 0.05), b"")

    def test_nothing_answers_where_nothing_is_connected(self):
        with Emulator("mpc", "--device", "none", "--pace", "off") as e, Port(e.path) as port:
            port.send(b"UKCI\x01HYNFOL\x00\x03M" + point(1, 1, 1) + b"S\x0f" + point(2, 2, 2))
            self.assertEqual(port.receive(1, 0.2), b"")

    def test_stop_at_half_way(self):
        for kind, request in (("trio", b"S\x00" + point(266667, TRIO_START, TRIO_START)), ("mpc", b"S\x00" + point(400000, 0, 0))):
            with Emulator(kind, "--pace", "off") as e, Port(e.path) as port:  # more than a minute
                port.send(request)
                self.assertEqual(port.receive(1, 0.1), b"")  # it moves
                self.assertEqual(port.ask(b"\x03", 1), CR)
                answer = port.ask(b"C", 14)
                x = struct.unpack_from("<I", answer, 1 if kind == "mpc" else 0)[0]
                self.assertTrue((0 if kind == "mpc" else TRIO_START) < x < 266667, x)
                self.assertEqual(port.ask(b"C", 14), answer)  # and it stands
                self.assertEqual(port.receive(1, 0.05), b"")


class Quirks(unittest.TestCase):
    def ask(self, quirks, request, count):
        with Emulator("mpc", "--quirks", quirks, "--pace", "off", "--speedup", "1000") as e, Port(e.path) as port:
            return port.ask(request, count), port.receive(1, 0.05)

    def test_bytes(self):
        self.assertEqual(self.ask("position-13", b"C", 13), (point(0, 0, 0) + CR, b""))
        self.assertEqual(self.ask("stop-says-i", b"\x03", 2), (b"I" + CR, b""))
        self.assertEqual(self.ask("nul-heartbeat", b"M" + point(16000, 0, 0), 4), (b"\0\0\0" + CR, b""))
        self.assertEqual(self.ask("stream-at-power-up", b"S\x0f" + point(32, 0, 0), 25),
                         (b"\xff\xff\xff" + stream(16, 0, 0) + b"\xff\xff\xff" + stream(32, 0, 0) + CR, b""))

    def test_observed(self):
        with Rehearsal("mpc", "--quirks", "observed", "--pace", "off", "--speedup", "1000") as e, Port(e.path) as port:
            port.send(b"M" + point(15, 15, 15))  # small-move-silent
            self.assertEqual(port.receive(1, 0.05), b"")
            self.assertEqual(port.ask(b"M" + point(16, 15, 15), 1), CR)
            # s-needs-pause is judged in real time, though the clock runs 1,000 times faster: from when the emulator has read it
            e.do("subscribe")
            port.send(b"S\x0f")
            while json.loads(e.lines.readline()).get("bytes") != "53 0F":
                pass
            time.sleep(0.05)
            self.assertEqual(port.ask(point(160, 0, 0), 1), CR)
            port.send(b"S\x0f" + point(320, 0, 0))
            self.assertEqual(port.receive(1, 0.1), b"")
            port.send(b"K")
            self.assertEqual(port.receive(1, 0.1), b"")


class Pace(unittest.TestCase):
    """Real time: only that nothing comes sooner than the line can carry it. How late it comes is the machine's."""

    def test_a_reply_takes_its_time_on_the_line(self):
        for kind, byte_s in (("trio", 10 / 57600), ("mpc", 10 / 128000)):
            with Emulator(kind) as e, Port(e.path) as port:
                before = time.monotonic()
                for _ in range(50):
                    self.assertEqual(len(port.ask(b"C", 14)), 14)
                self.assertGreaterEqual(time.monotonic() - before, 50 * 15 * byte_s)

    def test_speedup_is_how_much_faster_the_controllers_clock_runs(self):
        with Emulator("trio", "--speedup", "200", "--trace", "-") as e, Port(e.path) as port:
            def asked_at():
                self.assertEqual(len(port.ask(b"C", 14)), 14)
                return float(e.wait_for(b" > 43 ").split()[0])
            outer = time.monotonic()
            first = asked_at()
            inner = time.monotonic()
            time.sleep(0.05)
            inner = time.monotonic() - inner
            second = asked_at()
            outer = time.monotonic() - outer
            self.assertGreaterEqual(second - first, 200 * inner)
            self.assertLessEqual(second - first, 200 * outer)

    def test_a_fast_clock_has_a_fast_line(self):
        with Emulator("trio", "--speedup", "1000", "--trace", "-") as e, Port(e.path) as port:
            port.send(b"CR")  # 'R' begins when the reply to 'C' has left, and is itself answered
            self.assertEqual(len(port.receive(15)), 15)
            asked = float(e.wait_for(b" > 43 ").split()[0])
            began = float(e.wait_for(b" - runs to").split()[0])
            self.assertAlmostEqual(began - asked, 0.002431, delta=0.0000021)  # of the controller's clock

    def test_a_stream_that_the_line_cannot_carry_skips_positions(self):
        with Emulator("mpc", "--speedup", "10") as e, Port(e.path) as port:
            self.assertEqual(port.ask(b"O", 1), CR)
            port.send(b"S\x0f" + point(16000, 0, 0))
            got = b""
            while len(got) % 12 != 1:
                got += port.receive(12 - len(got) % 12 if len(got) % 12 else 12, 2)
                if got.endswith(CR) and len(got) % 12 == 1:
                    break
            frames = [got[i:i + 12] for i in range(0, len(got) - 1, 12)]
            self.assertTrue(all(frame.startswith(b"\xff\xff\xff") for frame in frames))
            at = [frame[3] | frame[4] << 8 | frame[5] << 16 for frame in frames]
            self.assertEqual(at, sorted(set(at)))
            self.assertTrue(all(x % 16 == 0 for x in at))
            self.assertLessEqual(len(frames), 821)  # 769 ms hold 820 frames of 937.5 us


def stream(x, y, z):
    return b"".join(struct.pack("<I", value)[:3] for value in (x, y, z))


if __name__ == "__main__":
    emu.main()
