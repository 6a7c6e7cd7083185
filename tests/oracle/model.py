"""Both controllers once more, in rational arithmetic, from the manuals and PROTOCOL.md alone.

Nothing here comes from firmware/core. Lengths are Fractions of a micron or whole microsteps, times whole microseconds
since the start of a scenario (they never wrap). Sources: [T], [M], [O], [P] as in PROTOCOL.md.
"""
from collections import deque
from fractions import Fraction
from math import ceil, cos, floor, pi, sin

X, Y, Z = 0, 1, 2
FULL = 'full'
CR = 13


class Stage:
    def __init__(self, step_um, full_mm_s, mm, trio=False):
        self.step_um = Fraction(step_um)
        self.full_um_s = Fraction(full_mm_s) * 1000
        self.trio = trio
        self.travel = [int(Fraction(m) * 1000 / self.step_um + Fraction(1, 2)) for m in mm]  # nearest

    def steps(self, um):
        return floor(Fraction(um) / self.step_um + Fraction(1, 2))


STAGES = {
    # [T tables 4, 5, note 11]
    'TRIO_MP845': Stage('0.09375', 5, ('25', '25', '25'), True),
    'TRIO_MP865': Stage('0.09375', 5, ('50', '12.5', '25'), True),
    'TRIO_MP285': Stage('0.125', 5, ('25', '25', '25'), True),
    'TRIO_MP265': Stage('0.125', 5, ('25', '12.5', '25'), True),
    # [M tables 6, 7, 8]
    'MPC_MP225': Stage('0.0625', 3, ('25', '25', '25')),
    'MPC_MP285': Stage('0.0625', 5, ('25', '25', '25')),
    'MPC_MP265': Stage('0.0625', 3, ('25', '12.5', '25')),
    'MPC_MP845': Stage('0.046875', 3, ('25', '25', '25')),
    'MPC_MP865': Stage('0.046875', 3, ('50', '12.5', '25')),
    'MPC_MT800': Stage('0.078125', 5, ('22', '22', '22')),
    'MPC_MOM': Stage('0.0625', 5, ('21.5', '21.5', '21.5')),
}

# [M table 2]: for the values 0..15 the angle and whether it is more steep than 45 degrees.
TABLE_2 = [(11, 1), (14, 1), (21, 1), (27, 1), (29, 1), (35, 1), (39, 1), (45, 0),
           (39, 0), (35, 0), (29, 0), (27, 0), (21, 0), (14, 0), (11, 0), (7, 0)]


def diagonal(value):
    """dX, dZ of the set diagonal, times 32768 [P]."""
    angle, more = TABLE_2[value]
    along = round(32768 * cos(angle * pi / 180)), round(32768 * sin(angle * pi / 180))
    return along[::-1] if more else along


SMALL_MOVE_SILENT, S_NEEDS_PAUSE, MEASURED, BOOT_SECOND = 1, 2, 4, 8
STREAM_AT_POWER_UP, ENDLESS_NEGATIVE, PAUSE_ON_STOP, QUERY_WEDGES = 16, 32, 64, 128
MEASURED_UM_S = [338, 361, 383, 412, 441, 478, 523, 573, 638, 718, 815, 958, 1139, 1404, 1890, 2767]

# Bytes after the command byte.
TRIO_ARGS = {'c': 0, 'C': 0, 'h': 0, 'w': 0, 'H': 12, 'W': 12, 'S': 13, 'x': 4, 'X': 4, 'y': 4, 'Y': 4, 'z': 4, 'Z': 4,
             'A': 1, 'R': 0, '\x03': 0}
MPC_ARGS = {'A': 0, 'U': 0, 'K': 0, 'C': 0, 'I': 1, 'H': 0, 'Y': 0, 'N': 0, 'M': 12, 'S': 13, '\x03': 0, 'F': 0, 'O': 0,
            'L': 1}
TRIO_MOVES = 'hwHWSxXyYzZR'
MPC_MOVES = 'HYNMS'


def args_of(trio, firmware, code):
    """How many bytes follow this command byte; None: the firmware (0x321 is 3.21) does not know it."""
    if trio:
        if code == 'R' and firmware < 0x262:
            return None
        return TRIO_ARGS.get(code)
    if (code == 'A' and firmware >= 0x300) or (code in 'USFO' and firmware < 0x300):
        return None
    return MPC_ARGS.get(code)


class Leg:
    """A piece of a move: every axis that moves has its own duration."""

    def __init__(self, stage, start, target, speed_um_s, straight):
        self.stage, self.start, self.target, self.speed, self.straight = stage, list(start), list(target), speed_um_s, straight
        ways = [abs(b - a) for a, b in zip(start, target)]
        self.um = max(ways) * stage.step_um  # the longest way
        own = [ceil(way * stage.step_um * 1000000 / speed_um_s) for way in ways]
        self.us = [max(own) if straight and way else own[axis] for axis, way in enumerate(ways)]
        self.lasts = max(own)

    def at(self, elapsed):
        here = []
        for a, b, us in zip(self.start, self.target, self.us):
            if elapsed >= us:
                here.append(b)
            else:
                gone = floor(Fraction(abs(b - a) * elapsed, us))
                here.append(a + gone if b > a else a - gone)
        return here

    def microns_by(self, elapsed):
        if not self.lasts:
            return 0
        return min(floor(self.um), floor(elapsed * self.um / self.lasts))

    def micron_at(self, k):
        return ceil(k * self.lasts / self.um)

    def from_here(self, elapsed):
        return Leg(self.stage, self.at(elapsed), self.target, self.speed, self.straight)


class Dwell:
    """Beyond 0 and back: the position does not show it. Stopped in it and resumed, it begins anew."""
    um = 0

    def __init__(self, here, lasts):
        self.here, self.lasts = list(here), lasts
        self.target = self.here

    def at(self, elapsed):
        return self.here

    def microns_by(self, elapsed):
        return 0

    def from_here(self, elapsed):
        return Dwell(self.here, self.lasts)


class Drive:
    def __init__(self, stage, position, diagonal=10, y_moves_home=True, work=None):
        self.stage = stage and STAGES[stage]
        self.position, self.work = list(position), work and list(work)
        self.diagonal, self.y_moves_home = diagonal, y_moves_home
        self.at_home = False


class Controller:
    def __init__(self, trio, firmware, drives, quirks=0, angle=30, home=(0, 0, 0), calibrates=True):
        self.trio, self.firmware, self.drives, self.quirks = trio, firmware, drives, quirks
        self.angle, self.home, self.calibrates = angle, list(home), calibrates
        self.unknown = self.lost = self.kept_commands = 0
        self.reset()
        self.state = 'rest'

    # -- power

    def reset(self):
        self.state = 'off'
        self.frame = b''
        self.frame_pause = self.pause = 0
        self.kept = deque()
        self.out = deque()
        self.crs = 0
        self.streaming = not self.trio and bool(self.quirks & STREAM_AT_POWER_UP)
        self.active = next((i for i, d in enumerate(self.drives) if d.stage), 0)
        self.leg, self.legs, self.op = None, [], None
        self.paused = False

    def power_off(self, t):
        self.settle(t)
        if self.state == 'off':
            return False
        if self.state == 'moving':
            self.drive.position = self.leg.at(t - self.began)
        for drive in self.drives:
            drive.at_home = False  # positions and work are kept over power-off [P], and no more
        self.reset()
        return True

    def power_on(self, t):
        if self.state != 'off':
            return False
        self.began = t
        if self.quirks & BOOT_SECOND:
            self.state = 'boot'
        else:
            self.boot(t)
        return True

    def boot(self, t):
        self.state = 'rest'
        if self.trio and self.calibrates:
            self.move(t, 'R', self.calibration(), answers=False)

    def place(self, t, drive, steps):
        self.settle(t)
        if self.state != 'rest':
            return False
        self.drives[drive].position = list(steps)
        self.drives[drive].at_home = False
        return True

    # -- time

    @property
    def drive(self):
        return self.drives[self.active]

    @property
    def connected(self):
        return [i for i, d in enumerate(self.drives) if d.stage]

    def streams(self):
        return self.state == 'moving' and not self.trio and self.op == 'S' and self.streaming

    def due(self):
        """The next instant at which something happens by itself."""
        if self.state == 'boot':
            return self.began + 1000000
        if self.state != 'moving':
            return None
        end = self.began + self.leg.lasts
        if self.streams() and not self.out and not self.crs and self.streamed < floor(self.leg.um):
            return min(end, self.began + self.leg.micron_at(self.streamed + 1))
        return end

    def settle(self, t):
        while True:
            if self.state == 'boot' and self.began + 1000000 <= t:
                self.boot(self.began + 1000000)
                continue
            if self.state != 'moving':
                return
            end = self.began + self.leg.lasts
            self.stream(min(t, end))
            if end > t:
                return
            self.arrive(end)

    def stream(self, t):
        if self.streams() and not self.out and not self.crs:
            k = self.leg.microns_by(t - self.began)
            if k > self.streamed:
                self.streamed = k
                self.out.extend(b'\xff\xff\xff')
                for steps in self.leg.at(self.leg.micron_at(k)):
                    self.out.extend((steps & 0xFFFFFF).to_bytes(3, 'little'))

    def arrive(self, t):
        self.drive.position = list(self.leg.target)
        if self.legs:
            self.begin(t, self.legs.pop(0))
            return
        self.state = 'rest'
        self.drive.at_home = not self.trio and self.op == 'H'
        if self.endless:
            self.state = 'stranded'
        elif self.answers:
            self.crs += 1
        else:
            self.next_kept(t)

    def begin(self, t, leg):
        self.leg, self.began, self.streamed = leg, t, 0

    def move(self, t, op, legs, answers=True, endless=False):
        self.op, self.answers, self.endless = op, answers, endless
        self.drive.at_home = False
        self.state = 'moving'
        self.legs = list(legs)
        self.begin(t, self.legs.pop(0))
        self.settle(t)  # what takes no time is over at once

    def where(self, t, drive):
        self.settle(t)
        if self.state == 'moving' and drive == self.active:
            return self.leg.at(t - self.began)
        return self.drives[drive].position

    # -- the host's side

    def pull(self, t, room):
        self.settle(t)
        got = b''
        while len(got) < room:
            if not self.out:
                if not self.crs:
                    break
                self.crs -= 1
                self.out.append(CR)
            got += bytes([self.out.popleft()])
            if not self.out and not self.crs:
                self.stream(t)
                self.next_kept(t)
        return got

    def ready(self):
        return len(self.out) + self.crs

    def busy(self):
        return self.state != 'rest' or self.out or self.crs or self.kept

    def next_kept(self, t):
        while self.kept and self.state == 'rest' and not self.out and not self.crs:
            self.execute(t, self.kept.popleft())

    def host_paused(self, us):
        self.pause += us

    def push(self, t, data):
        self.settle(t)
        for byte in data:
            if self.state in ('off', 'boot', 'wedged'):
                self.lost += 1
                self.frame, self.pause = b'', 0
                continue
            if not self.frame:
                if byte in (13, 10):
                    self.pause = 0
                    continue
                if args_of(self.trio, self.firmware, chr(byte)) is None:
                    self.unknown += 1
                    self.pause = 0
                    continue
                self.frame_pause = 0
            else:
                self.frame_pause += self.pause
            self.pause = 0
            self.frame += bytes([byte])
            if len(self.frame) == 1 + args_of(self.trio, self.firmware, chr(self.frame[0])):
                frame, self.frame = self.frame, b''
                self.whole(t, frame)

    def whole(self, t, frame):
        code = chr(frame[0])
        if code == '\x03':
            self.interrupt(t)
            return
        wedges = (not self.trio and code == 'S' and self.quirks & S_NEEDS_PAUSE and self.frame_pause < 20000
                  or code in 'cC' and self.quirks & QUERY_WEDGES and self.state == 'moving')
        if wedges:
            if self.state == 'moving':
                self.drive.position = self.leg.at(t - self.began)
            self.state = 'wedged'
            self.out.clear()
            self.crs = 0
            self.kept.clear()
        elif not self.busy():
            self.execute(t, frame)
        elif sum(map(len, self.kept)) + len(frame) > 64:
            self.lost += len(frame)
        else:
            self.kept.append(frame)
            self.kept_commands += 1

    def interrupt(self, t):
        if not self.trio and not self.connected:
            return
        if self.state == 'moving':
            if self.trio and self.op != 'S':
                return  # only 'S' can be stopped
            elapsed = t - self.began
            self.drive.position = list(self.leg.at(elapsed))
            if self.quirks & PAUSE_ON_STOP:
                self.paused = True
                self.legs.insert(0, self.leg.from_here(elapsed))
        self.state = 'rest'
        self.crs += 1

    # -- commands

    def speed(self, level):
        stage = self.drive.stage
        if self.trio:
            return Fraction(5000) if level == FULL else Fraction(5000, 16) * (level + 1)  # [T note 11]
        if self.quirks & MEASURED:
            return Fraction(4650 if level == FULL else MEASURED_UM_S[level])
        return stage.full_um_s if level == FULL else Fraction(1300, 16) * (level + 1)  # [M note 12]

    def each(self, start, target):
        return Leg(self.drive.stage, start, target, self.speed(FULL), False)

    def straight(self, start, target, level=FULL):
        return Leg(self.drive.stage, start, target, self.speed(level), True)

    def chain(self, stops, straight=()):
        """Legs through these points, each axis for itself but for those of the given indices."""
        return [(self.straight if i in straight else self.each)(a, b) for i, (a, b) in enumerate(zip(stops, stops[1:]))]

    def answer(self, *parts):
        for part in parts:
            self.out.extend(bytes([part]) if isinstance(part, int) else part)
        self.out.append(CR)

    def execute(self, t, frame):
        code, args = chr(frame[0]), frame[1:]
        if not self.trio and not self.connected:
            return  # [P]: nothing is answered at all
        if self.paused and code in (TRIO_MOVES if self.trio else MPC_MOVES):
            self.paused = False
            legs = self.legs
            if len(legs) == {'H': 2, 'N': 3}.get(self.op):  # on the diagonal: from here on it is another one
                legs = self.chain(self.home_path(self.drive.position, self.op == 'N' or self.drive.y_moves_home), [0]) + legs[2:]
            self.move(t, self.op, legs, True, self.endless)
        elif self.trio:
            self.execute_trio(t, code, args)
        else:
            self.execute_mpc(t, code, args)

    def position_bytes(self):
        return b''.join(steps.to_bytes(4, 'little') for steps in self.drive.position)

    def targets(self, args):
        """The coordinates of a command within the travel, and whether one of them runs for ever."""
        endless, inside = False, []
        for axis, travel in enumerate(self.drive.stage.travel):
            steps = int.from_bytes(args[4 * axis:4 * axis + 4], 'little')
            if self.quirks & ENDLESS_NEGATIVE and steps > 0x7FFFFFFF:
                endless, steps = True, 0
            inside.append(min(steps, travel))
        return inside, endless

    # TRIO

    def stands(self):
        return {0: Z, 90: X}.get(self.angle)

    def ordered(self, target, work, stands):
        """Home or work order [T page 1]: Y last or first; of X and Z that first which the angle prefers."""
        here = list(self.drive.position)
        pairs = [[X, Z]] if self.angle == 45 else [[Z], [X]] if self.angle < 45 else [[X], [Z]]
        stops = [here]
        for axes in ([[Y]] + pairs if work else pairs + [[Y]]):
            here = list(here)
            for axis in axes:
                if axis != stands:
                    here[axis] = target[axis]
            stops.append(here)
        return self.chain(stops)

    def calibration(self):
        legs = self.ordered([0, 0, 0], False, None)
        return legs + [self.each([0, 0, 0], [self.drive.stage.steps(1000)] * 3)]

    def execute_trio(self, t, code, args):
        here = self.drive.position
        if code in 'cC':
            self.answer(self.position_bytes(), self.angle)
        elif code == 'A':
            if args[0] <= 90:
                self.angle = args[0]
            self.answer()
        elif code == 'R':
            self.move(t, code, self.calibration())
        elif code == 'h':
            target = list(self.home)
            if not self.drive.y_moves_home:
                target[Y] = here[Y]
            self.move(t, code, self.ordered(target, False, self.stands()))
        elif code == 'w':
            if self.drive.work is None:
                self.answer()
            else:
                self.move(t, code, self.ordered(self.drive.work, True, self.stands()))
        elif code in 'HW':
            target, endless = self.targets(args)
            self.move(t, code, self.ordered(target, code == 'W', self.stands()), True, endless)
        elif code == 'S':
            target, endless = self.targets(args[1:])
            if self.stands() is not None:
                target[self.stands()] = here[self.stands()]
            self.move(t, code, [self.straight(here, target, args[0] & 15)], True, endless)
        else:
            axis = 'xyz'.index(code.lower())
            target, endless = self.targets(args * 3)
            target = [target[axis] if i == axis and i != self.stands() else here[i] for i in range(3)]
            self.move(t, code, [self.each(here, target)], True, endless)

    # MPC-200

    def home_path(self, start, with_y):
        """Two legs: along the diagonal until X or Z is 0; Y and the other axis [P]."""
        dx, dz = diagonal(self.drive.diagonal)
        x, y, z = start
        if x * dz <= z * dx:
            corner = [0, y, z - x * dz // dx]
        else:
            corner = [x - z * dx // dz, y, 0]
        return [list(start), corner, [0, 0 if with_y else y, 0]]

    def execute_mpc(self, t, code, args):
        drive, here = self.drive, self.drive.position
        number = self.active + 1
        if code == 'A':
            self.answer(len(self.connected))
        elif code == 'U':
            self.answer(len(self.connected), bytes(1 if i in self.connected else 0 for i in range(4)))
        elif code == 'K':
            if self.firmware < 0x300:
                self.answer(number)
            else:
                self.answer(number, self.firmware & 0xFF, self.firmware >> 8)
        elif code == 'C':
            self.answer(number, self.position_bytes())
        elif code == 'I':
            there = args[0] - 1 in self.connected
            if there:
                self.active = args[0] - 1
            if self.firmware < 0x106:
                self.answer()
            else:
                self.answer(args[0] if there else ord('E'))
        elif code in 'FO':
            self.streaming = code == 'O'
            self.answer()
        elif code == 'L':
            self.answer()
        elif code == 'H':
            self.move(t, code, self.chain(self.home_path(here, drive.y_moves_home), [0]))
        elif code == 'Y':
            if drive.work is None or not drive.at_home:
                self.answer()
                return
            work = list(drive.work)
            if not drive.y_moves_home:
                work[Y] = here[Y]
            corner = self.home_path(work, True)[1]
            self.move(t, code, self.chain([here, corner, work], [1]))
        elif code == 'N' and self.firmware <= 0x103:
            self.move(t, code, [self.straight(here, [travel // 2 for travel in drive.stage.travel])])
        elif code == 'N':
            dwell = Dwell([0, 0, 0], 2 * ceil(250 * 1000000 / self.speed(FULL)))
            self.move(t, code, self.chain(self.home_path(here, True), [0]) + [dwell])
        else:
            target, endless = self.targets(args[-12:])
            if self.quirks & SMALL_MOVE_SILENT and all(abs(b - a) < 16 for a, b in zip(here, target)):
                return
            leg = self.each(here, target) if code == 'M' else self.straight(here, target, args[0] & 15)
            self.move(t, code, [leg], True, endless)
