#!/usr/bin/python3
"""Random scenarios, through the core (oracle_driver) and through model.py: every byte at its microsecond must agree.

    oracle.py DRIVER [--count N] [--seed FIRST] [--show SEED]

Scenario number n depends on n alone. A failing one is made as short as it goes and printed as the text that the driver
reads, with both transcripts from where they part. Exit: 0 all agree, 1 they do not.
"""
import argparse
import copy
import random
import subprocess
import sys

import model

MOST_BYTES = 3000  # a scenario ends when the host has got so many
CLOCKS = [0, 2**31 - 5, 2**31 - 250000, 2**32 - 1, 2**32 - 1000, 2**32 - 300000]
TRIO_FIRMWARE = [0x312, 0x312, 0x262, 0x261, 0x100]
MPC_FIRMWARE = [0x321, 0x321, 0x321, 0x319, 0x316, 0x313, 0x300, 0x299, 0x106, 0x105, 0x104, 0x103, 0x100]
OBSERVED = model.SMALL_MOVE_SILENT | model.S_NEEDS_PAUSE | model.MEASURED | model.BOOT_SECOND


def fits(stage, firmware, port):
    """[M table 7]"""
    if stage == 'MPC_MP845':
        return firmware >= 0x319
    if stage == 'MPC_MP865':
        return firmware >= 0x321
    if stage == 'MPC_MOM':
        return firmware in (0x313, 0x316) and port in (1, 3)
    return True


class Setup:
    """What is set before the start."""

    def __init__(self, rng):
        self.trio = rng.random() < 0.4
        self.firmware = rng.choice(TRIO_FIRMWARE if self.trio else MPC_FIRMWARE)
        self.quirks = rng.choice([0] * 8 + [1 << bit for bit in range(8)] * 2 + [OBSERVED] * 4)
        self.clock = rng.choice(CLOCKS + [rng.randrange(2**32)])
        self.pace = 0 if self.quirks & (model.S_NEEDS_PAUSE | model.QUERY_WEDGES) or rng.random() < 0.5 \
            else rng.choice([174 if self.trio else 78, 7, 1000])
        self.angle = rng.choice([0, 1, 30, 44, 45, 46, 89, 90, rng.randrange(91)])
        if self.quirks & model.ENDLESS_NEGATIVE and self.angle in (0, 90):
            self.angle = 45
        self.calibrates = rng.random() < 0.5
        self.drives = []
        names = [name for name, stage in model.STAGES.items() if stage.trio == self.trio]
        empty = 0.0 if self.trio else 1.0 if rng.random() < 0.02 else 0.3
        for port in range(1, 2 if self.trio else 5):
            allowed = [name for name in names if self.trio or fits(name, self.firmware, port)]
            stage = None if rng.random() < empty else rng.choice(allowed)
            travel = model.STAGES[stage].travel if stage else [0] * 3
            self.drives.append((stage, somewhere(rng, travel), rng.randrange(16), rng.random() < 0.7,
                                somewhere(rng, travel) if rng.random() < 0.6 else None))
        self.home = somewhere(rng, model.STAGES[self.drives[0][0]].travel) if self.trio else [0, 0, 0]

    def controller(self):
        drives = [model.Drive(*drive) for drive in self.drives]
        return model.Controller(self.trio, self.firmware, drives, self.quirks, self.angle, self.home, self.calibrates)

    def lines(self):
        yield 'controller ' + ('trio' if self.trio else 'mpc')
        yield f'firmware {self.firmware:x}'
        yield f'quirks {self.quirks}'
        yield f'clock {self.clock}'
        yield f'pace {self.pace}'
        if self.trio:
            yield f'angle {self.angle}'
            yield f'calibrates {int(self.calibrates)}'
            yield 'home ' + words(self.home)
        for stage, position, diagonal, y_moves_home, work in self.drives:
            yield f'drive {stage or "NONE"} {words(position)} {diagonal} {int(y_moves_home)} {words(work or [])}'.rstrip()
        yield 'start'


def words(numbers):
    return ' '.join(map(str, numbers))


def somewhere(rng, travel):
    kind = rng.random()
    if kind < 0.3:
        return [rng.randrange(min(3000, t) + 1) for t in travel]
    return [rng.choice([0, t, t // 2, rng.randrange(t + 1), rng.randrange(min(t, 400) + 1)]) for t in travel]


class Run:
    """The model under the same caller as tests/sim: it comes at each due instant."""

    def __init__(self, setup):
        self.setup = setup
        self.c = setup.controller()
        self.now = self.free = self.bytes = 0
        self.events, self.transcript = [], []

    def pump(self):
        while True:
            got = self.c.pull(self.now, 1 if self.free <= self.now else 0)
            if not got:
                return
            self.transcript.append(f'{self.now} {got[0]:02x}')
            self.bytes += 1
            self.free = self.now + self.setup.pace

    def next_visit(self):
        at = self.c.due()
        if self.c.ready():
            at = self.free if at is None else min(at, self.free)
        return at

    def run_to(self, until):
        """False: it stopped before, because the host has got enough."""
        while True:
            self.pump()
            at = self.next_visit()
            if at is None or (until is not None and at > until):
                break
            if self.bytes > MOST_BYTES:
                return False
            self.now = at
        if until is not None and self.now < until:
            self.now = until
            self.pump()
        return True

    def act(self, event):
        """event: what, at, the rest."""
        what, at, *rest = event
        if not self.run_to(at):
            return False
        self.events.append(event)
        c = self.c
        if what == 'push':
            c.push(self.now, rest[0])
        elif what == 'paused':
            c.host_paused(rest[0])
        elif what == 'power':
            result = c.power_on(self.now) if rest[0] else c.power_off(self.now)
            self.transcript.append(f'poke {self.now} {int(result)}')
        elif what == 'place':
            self.transcript.append(f'poke {self.now} {int(c.place(self.now, rest[0], rest[1:]))}')
        elif what == 'where':
            self.transcript.append(f'where {self.now} {words(c.where(self.now, rest[0]))}')
        self.pump()
        return True

    def end(self):
        self.pump()
        self.events.append(('end', self.now))
        state = ['off', 'boot', 'rest', 'moving', 'stranded', 'wedged'].index(self.c.state)
        lost = self.c.lost
        self.transcript.append(f'end {state} {self.c.unknown} {lost} {self.c.kept_commands}')

    def text(self):
        lines = list(self.setup.lines())
        for what, at, *rest in self.events:
            lines.append(f'{what} {at} ' + words(r.hex() if isinstance(r, bytes) else r for r in rest))
        return '\n'.join(line.rstrip() for line in lines) + '\n'


# -- What a host does ----------------------------------------------------------------------------------------------------

class Host:
    def __init__(self, seed):
        self.rng = random.Random(seed)
        self.run = Run(Setup(self.rng))

    def play(self):
        rng, run = self.rng, self.run
        act = self.random_bytes if rng.random() < 0.2 else self.structured
        for _ in range(rng.randrange(3, 16)):
            if not self.wait() or not act():
                break
        if rng.random() < 0.8:
            run.run_to(None)
        run.end()
        return run

    def wait(self):
        """Some time goes by, often until just before, at or after something happens."""
        rng, run = self.rng, self.run
        kind, due = rng.random(), run.c.due()
        if kind < 0.15:
            return True
        if kind < 0.3:
            return run.run_to(run.now + rng.randrange(300))
        if kind < 0.4:
            return run.run_to(run.now + rng.randrange(30000))
        if due is not None and kind < 0.6:
            return run.run_to(max(run.now, due + rng.randrange(-1, 2)))
        if due is not None and kind < 0.8:
            return run.run_to(rng.randrange(run.now, due + 1))
        if run.c.ready() and kind < 0.9:
            return run.run_to(max(run.now, run.free + rng.randrange(-1, 2)))
        return run.run_to(None)

    def one_frame_a_push(self):
        return bool(self.run.setup.quirks & (model.S_NEEDS_PAUSE | model.QUERY_WEDGES))

    def send(self, data):
        """In one piece or in several, with pauses."""
        rng, run = self.rng, self.run
        pieces = [data]
        if len(data) > 1 and rng.random() < 0.4:
            cuts = sorted(rng.sample(range(1, len(data)), min(len(data) - 1, rng.choice([1, 1, 2, 13]))))
            pieces = [data[a:b] for a, b in zip([0] + cuts, cuts + [len(data)])]
        for i, piece in enumerate(pieces):
            if i and rng.random() < 0.7 and (len(run.c.frame) < 3 or not run.c.quirks & model.S_NEEDS_PAUSE):
                pause = rng.choice([1, 9999, 10000, 19999, 20000, 30000])
                if not run.act(('paused', run.now, pause)) or \
                        rng.random() < 0.8 and not run.run_to(run.now + rng.choice([0, 1, pause])):
                    return False
            if not run.act(('push', run.now, piece)):
                return False
        return True

    def coordinate(self, axis):
        rng, c = self.rng, self.run.c
        stage = c.drive.stage
        if stage is None:
            return rng.randrange(2**32)
        here = c.where(self.run.now, c.active)[axis]
        travel = stage.travel[axis]
        near = 30 if c.streaming else 3000
        return rng.choice([here, here, max(0, here + rng.randrange(-20, 21)), max(0, here + rng.randrange(-20, 21)),
                           max(0, here + rng.randrange(-near, near)), max(0, here + rng.randrange(-near, near)),
                           rng.choice([0, travel, rng.randrange(travel + 1), travel + 1, 2**31 - 1, 2**31, 2**32 - 1,
                                       13 * 0x01010101, 3 * 0x01010101])])

    def frame(self, code):
        rng, c = self.rng, self.run.c
        data = bytes([ord(code)])
        if code == 'A' and c.trio:
            angles = [1, 30, 44, 45, 46, 89, rng.randrange(91), 91, 255]
            return data + bytes([rng.choice(angles if c.quirks & model.ENDLESS_NEGATIVE else angles + [0, 90])])
        if code in 'IL' and not c.trio:
            return data + bytes([rng.choice([0, 1, 2, 3, 4, 5, 9, 10, ord('1'), 3, 13])])
        if code == 'S':
            data += bytes([rng.choice([15, 15, 14, 13, rng.randrange(16), 0x1F, 0xFF])])
        args = model.args_of(c.trio, c.firmware, code)
        if args in (12, 13):
            return data + b''.join(self.coordinate(axis).to_bytes(4, 'little') for axis in range(3))
        if args == 4:
            return data + self.coordinate('xyz'.index(code.lower())).to_bytes(4, 'little')
        return data

    def structured(self):
        rng, run = self.rng, self.run
        c = run.c
        kind = rng.random()
        if kind < 0.06:
            return run.act(('where', run.now, rng.randrange(len(c.drives))))
        if kind < 0.10:
            return run.act(('power', run.now, int(c.state == 'off')))
        if kind < 0.13 and c.state in ('rest', 'moving') and not c.paused and c.drive.stage:
            drive = rng.choice(c.connected)
            return run.act(('place', run.now, drive, *somewhere(rng, c.drives[drive].stage.travel)))
        if kind < 0.25:
            return run.act(('push', run.now, b'\x03'))
        if kind < 0.30:
            return run.act(('push', run.now, bytes([rng.choice([13, 10, 0xEE, 0x22, 0, 0x5B, rng.randrange(256)])])))
        letters = 'ccCCHhwWSSSxXyYzZAR' if c.trio else 'CCCKUAIIHHYYNMMMSSSSFOL'
        if rng.random() < 0.4 and not c.trio:
            letters = 'SSSOOCF'
        if c.quirks & model.PAUSE_ON_STOP:  # nobody says what the other drive's next move then is
            letters = letters.replace('I', '')
        count = 1 if self.one_frame_a_push() else rng.choice([1, 1, 1, 2, 3, 6])
        frames = [self.frame(rng.choice(letters)) for _ in range(count)]
        if rng.random() < 0.3:
            return all(self.send(frame) for frame in frames)
        return self.send(b''.join(frames))

    def random_bytes(self):
        rng, run = self.rng, self.run
        # Selecting another drive while a paused move waits, running for ever along an axis that stands still at this
        # angle, what a wedging controller still had to send: nobody says what is to happen then.
        if run.c.quirks & (model.PAUSE_ON_STOP | model.ENDLESS_NEGATIVE) or self.one_frame_a_push():
            return self.structured()
        alphabet = b'cChwHWSxyzAR\x03KUIYNMFOL\x00\x01\x02\x0d\xff' + bytes(rng.randrange(256) for _ in range(9))
        return run.act(('push', run.now, bytes(rng.choice(alphabet) for _ in range(rng.choice([1, 2, 10, 40, 300])))))


# -- Comparing -----------------------------------------------------------------------------------------------------------

def core(driver, text):
    done = subprocess.run([driver], input=text, capture_output=True, text=True, check=False)
    out = done.stdout.splitlines()
    if done.returncode:
        out.append(f'driver: exit {done.returncode} {done.stderr.strip()[:3000]}')
    return out


def replay(setup, events):
    run = Run(copy.deepcopy(setup))
    for event in events:
        if event[0] == 'end':
            run.run_to(event[1])
            break
        if not run.act(event):
            break
    run.end()
    return run


def differs(driver, run):
    got = core(driver, run.text())
    for i in range(max(len(got), len(run.transcript))):
        a = got[i] if i < len(got) else '(nothing)'
        b = run.transcript[i] if i < len(run.transcript) else '(nothing)'
        if a != b:
            return i, got
    return None


def shorten(driver, run):
    events = run.events
    again = True
    while again:
        again = False
        for i in range(len(events) - 1):
            candidate = replay(run.setup, events[:i] + events[i + 1:])
            if differs(driver, candidate):
                run, events, again = candidate, candidate.events, True
                break
    return run


def report(driver, seed, run):
    run = shorten(driver, run)
    where, got = differs(driver, run)
    print(f'scenario {seed} differs; made short:\n{run.text()}')
    for name, lines in (('core ', got), ('model', run.transcript)):
        print(f'{name}: ...', *lines[max(0, where - 8):where], '|', *lines[where:where + 16])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('driver')
    parser.add_argument('--count', type=int, default=3000)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--show', type=int, help='print one scenario and its transcript, and run nothing')
    parser.add_argument('--most', type=int, default=5, help='stop after so many failures')
    options = parser.parse_args()
    if options.show is not None:
        run = Host(options.show).play()
        print(run.text() + '\n'.join(run.transcript))
        return 0
    failures = total = 0
    seeds = range(options.seed, options.seed + options.count)
    for first in range(0, len(seeds), 200):
        batch = [(seed, Host(seed).play()) for seed in seeds[first:first + 200]]
        total += sum(run.bytes for _, run in batch)
        want = [line for _, run in batch for line in run.transcript]
        if core(options.driver, ''.join(run.text() for _, run in batch)) == want:
            continue
        for seed, run in batch:
            if differs(options.driver, run):
                report(options.driver, seed, run)
                failures += 1
                if failures >= options.most:
                    return 1
        if not failures:
            print('a batch differs though each of its scenarios agrees: state leaks from one to the next')
            return 1
    print(f'{options.count} scenarios, {total} bytes from the controllers: {failures} differ')
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
