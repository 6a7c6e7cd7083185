"""--clock step: a move that is stopped at exactly 250 ms, or at any other microsecond, is where arithmetic says, to the microstep.

The arithmetic is that of PROTOCOL.md, "Moves and time", "Speeds", "Order of axes" and "Home", typed from there: nothing here is
the emulator's."""
import random
import unittest

import emu
from ctl import Rehearsal
from emu import Port, point

CR = b"\r"
# quanta (1/64 um) a step, full speed in um/s, travel in steps [Stages]
STAGES = {"trio": {"MP-845": (6, 5000, (266667, 266667, 266667)), "MP-285": (8, 5000, (200000, 200000, 200000)),
                   "MP-865": (6, 5000, (533333, 133333, 266667))},
          "mpc": {"MP-225": (4, 3000, (400000, 400000, 400000)), "MP-285": (4, 5000, (400000, 400000, 400000)),
                  "MT-800": (5, 5000, (281600, 281600, 281600)), "MP-845": (3, 3000, (533333, 533333, 533333))}}
DIAGONAL = (28660, 15886)  # 29 degrees, less: dX : dZ
X, Y, Z = range(3)


def lasts_us(way, quanta, sixteenths_of_um_per_s):
    """way / speed, rounded up to a whole microsecond."""
    return -(-way * quanta * 16 * 1000000 // (64 * sixteenths_of_um_per_s))


def gone(start, end, elapsed, lasts):
    if elapsed >= lasts:
        return end
    steps = abs(end - start) * elapsed // lasts
    return start + steps if end > start else start - steps


class Leg:
    """Some axes from here to there: each at its own speed, or together."""

    def __init__(self, start, end, quanta, speed, together):
        self.start, self.end = start, end
        ways = [abs(e - s) for s, e in zip(start, end)]
        each = [lasts_us(way, quanta, speed) for way in ways]
        self.lasts = [max(each) if together else us for us in each]
        self.whole = max(self.lasts)

    def at(self, elapsed):
        return [gone(s, e, elapsed, us) for s, e, us in zip(self.start, self.end, self.lasts)]


def legs_of(kind, op, start, end, quanta, full, level, angle):
    """The legs of a move, one after the other."""
    full *= 16
    line = (5000 if kind == "trio" else 1300) * (level + 1)
    if op == "S":
        return [Leg(start, end, quanta, line, True)]
    if op == "M":
        return [Leg(start, end, quanta, full, False)]
    if op in "xyz":
        end = [e if axis == "xyz".index(op) else s for axis, (s, e) in enumerate(zip(start, end))]
        return [Leg(start, end, quanta, full, False)]
    if op == "home":  # of an MPC: the diagonal first, then Y and what is left
        cos, sin = DIAGONAL
        if start[X] * sin <= start[Z] * cos:
            middle = [0, start[Y], start[Z] - start[X] * sin // cos]
        else:
            middle = [start[X] - start[Z] * cos // sin, start[Y], 0]
        return [Leg(start, middle, quanta, full, True), Leg(middle, [0, 0, 0], quanta, full, False)]
    xz = [(X, Z)] if angle == 45 else [(Z,), (X,)] if angle < 45 else [(X,), (Z,)]
    legs, here = [], start
    for axes in xz + [(Y,)] if op == "H" else [(Y,)] + xz:
        there = [end[axis] if axis in axes else here[axis] for axis in range(3)]
        legs.append(Leg(here, there, quanta, full, False))
        here = there
    return legs


def place(legs, elapsed):
    for leg in legs:
        if elapsed < leg.whole:
            return leg.at(elapsed)
        elapsed -= leg.whole
    return legs[-1].end


class Exact(unittest.TestCase):
    def stop_moves(self, kind, ops):
        chance = random.Random(5)
        for model, (quanta, full, travel) in STAGES[kind].items():
            with Rehearsal(kind, "--device", model, "--clock", "step") as e, Port(e.path) as port:
                for op, level, angle in ops:
                    with self.subTest(f"{kind} {model} {op} {level} {angle}"):
                        start, end = ([chance.randrange(last + 1) for last in travel] for _ in range(2))
                        e.do("set position " + ",".join(map(str, start)))
                        if kind == "trio":
                            e.do(f"set angle {angle}")
                        legs = legs_of(kind, op, start, end, quanta, full, level, angle)
                        port.send({"S": b"S" + bytes([level]) + point(*end), "home": b"H"}.get(
                            op, op.encode() + (end["xyz".index(op)].to_bytes(4, "little") if op in "xyz" else point(*end))))
                        whole = sum(leg.whole for leg in legs)
                        passed = 0
                        for instant in sorted({0, 1, 250000, chance.randrange(whole), whole - 1}):
                            if passed <= instant < whole:
                                e.do(f"advance {instant - passed}us")
                                passed = instant
                                self.assertEqual(place(legs, instant), e.position(), f"after {instant} us of {whole}")
                        self.assertEqual(port.waiting(), 0)
                        e.do("advance 1us" if passed == whole - 1 else f"advance {whole - passed}us")
                        self.assertEqual(port.receive(1), CR)
                        self.assertEqual(legs[-1].end, e.position())

    def test_every_speed_of_a_trio(self):
        self.stop_moves("trio", [("S", level, 30) for level in range(16)])

    def test_every_order_of_a_trio(self):
        self.stop_moves("trio", [(op, 0, angle) for op in ("H", "W", "x", "y", "z") for angle in (1, 30, 45, 46, 89)])

    def test_every_speed_of_an_mpc(self):
        self.stop_moves("mpc", [("S", level, 0) for level in range(16)])

    def test_moves_of_an_mpc(self):
        self.stop_moves("mpc", [(op, 0, 0) for op in ("M", "home") * 8])

    def test_stopped_at_250_ms(self):
        """^C, and what the controller itself tells then."""
        for kind, op, level in (("mpc", "M", 0), ("mpc", "S", 0), ("mpc", "S", 15), ("mpc", "home", 0), ("trio", "S", 0),
                                ("trio", "S", 7), ("trio", "S", 15)):
            model = "MP-845"
            quanta, full, _ = STAGES[kind][model]
            start, end = [100000, 200000, 100001], [3, 77777, 133333]
            with self.subTest(f"{kind} {op} {level}"), Rehearsal(kind, "--device", model, "--clock", "step") as e, \
                    Port(e.path) as port:
                e.do("set position " + ",".join(map(str, start)))
                if op == "home":
                    port.send(b"H")
                else:
                    port.send((b"M" if op == "M" else b"S" + bytes([level])) + point(*end))
                e.do("advance 250ms")
                port.send(b"\x03")
                self.assertEqual(port.receive(1), CR)
                wanted = place(legs_of(kind, op, start, end, quanta, full, level, 30), 250000)
                answer = port.ask(b"C", 14)
                self.assertEqual(point(*wanted), answer[1:13] if kind == "mpc" else answer[:12])
                e.do("advance 1h")
                self.assertEqual(wanted, e.position())


if __name__ == "__main__":
    emu.main()
