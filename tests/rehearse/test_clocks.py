"""The clocks: `jump` leaps to the next event, `step` stands still until it is told, --wait-client holds every clock."""
import os
import struct
import unittest

import emu
from emu import Emulator, Port, point

CR = b"\r"


def at(answer):
    return struct.unpack("<III", answer[1:13])


class Jump(unittest.TestCase):
    def test_moves_of_hours_end_at_once_and_last_as_long_as_ever_in_the_trace(self):
        with emu.directory() as d:
            trace = os.path.join(d, "trace")
            with Emulator("mpc", "--clock", "jump", "--trace", trace) as e, Port(e.path) as port:
                for i in range(200):  # 25 mm at 3 mm/s: 8.333334 s each
                    self.assertEqual(port.ask(b"M" + point(400000 if i % 2 == 0 else 0, 0, 0), 1), CR)
            with open(trace, encoding="ascii") as file:
                arrived = [line for line in file if "arrived" in line]
        self.assertEqual(len(arrived), 200)
        self.assertEqual([line.split()[0] for line in arrived[:3]], ["8.333334", "16.666668", "25.000002"])
        self.assertEqual(arrived[-1].split()[0], "1666.666800")

    def test_a_long_stream_loses_nothing_however_slowly_it_is_read(self):
        with Emulator("mpc", "--clock", "jump") as e, Port(e.path) as port:
            self.assertEqual(port.ask(b"O", 1), CR)
            port.send(b"S\x00" + point(400000, 0, 0))  # 25,000 frames: far more than any buffer holds
            got = port.receive(25000 * 12 + 1)
            self.assertEqual(len(got), 25000 * 12 + 1)
            for k in (1, 2, 1000, 25000):
                self.assertEqual(got[12 * (k - 1):12 * k], b"\xff\xff\xff" + (16 * k).to_bytes(3, "little") + bytes(6))

    def test_the_same_bytes_give_the_same_trace(self):
        traces = []
        for _ in range(3):
            with emu.directory() as d:
                trace = os.path.join(d, "trace")
                with Emulator("trio", "--clock", "jump", "--trace", trace) as e, Port(e.path) as port:
                    for target in ((1, 2, 3), (200000, 0, 5), (266667, 266667, 266667)):
                        port.ask(b"H" + point(*target), 1)
                        port.ask(b"c", 14)
                    port.ask(b"R", 1)
                with open(trace, encoding="ascii") as file:
                    traces.append([line for line in file if "the port" not in line])
        self.assertEqual(traces[0], traces[1])
        self.assertEqual(traces[0], traces[2])

    def test_idle_costs_nothing(self):
        with Emulator("mpc", "--clock", "jump") as e, Port(e.path) as port:
            self.assertTrue(e.is_idle())
            port.ask(b"M" + point(400000, 0, 0), 1)
            self.assertTrue(e.is_idle())

    def test_a_host_that_does_not_read_stops_time_and_costs_nothing(self):
        with Emulator("mpc", "--clock", "jump") as e:
            with Port(e.path) as port:
                self.assertEqual(port.ask(b"O", 1), CR)
                port.send(b"S\x00" + point(400000, 0, 0))
                emu.wait_until(lambda: port.waiting() >= 4095, "the port is full")
                self.assertTrue(e.is_idle())
            with Port(e.path) as port:  # it has gone: time goes on, for nobody or for the next one, who may see the end
                port.send(b"C")
                answer = b"\x01" + point(400000, 0, 0) + CR
                self.assertEqual(port.receive_through(answer)[-14:], answer)


class Step(unittest.TestCase):
    def test_a_move_does_not_end_by_itself(self):
        with Emulator("mpc", "--clock", "step") as e, Port(e.path) as port:
            self.assertEqual(at(port.ask(b"C", 14)), (0, 0, 0))
            port.send(b"M" + point(1600, 0, 0))
            self.assertTrue(e.is_idle())
            self.assertEqual(port.waiting(), 0)
            self.assertEqual(port.ask(b"\x03", 1), CR)
            self.assertEqual(at(port.ask(b"C", 14)), (0, 0, 0))


class WaitClient(unittest.TestCase):
    def test_the_clock_stands_until_somebody_has_opened_the_port(self):
        with emu.directory() as d:
            trace = os.path.join(d, "trace")
            with Emulator("mpc", "--wait-client", "--trace", trace) as e:
                self.assertTrue(e.is_idle())  # takes a quarter of a second
                with Port(e.path) as port:
                    self.assertEqual(port.ask(b"K", 4), emu.ACTIVE[1])
            with open(trace, encoding="ascii") as file:
                opened = [line for line in file if "has been opened" in line]
            self.assertEqual(opened[0].split()[0], "0.000000")


class Wrong(unittest.TestCase):
    def test_options(self):
        for args, words in ((["--clock", "fast"], ("real", "step", "jump")), (["--clock", "jump", "--speedup", "2"], ("speed",))):
            status, _, error = emu.outcome("mpc", *args)
            self.assertEqual(status, 2)
            for word in words:
                self.assertIn(word, error)


if __name__ == "__main__":
    emu.main()
