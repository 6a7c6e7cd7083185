#!/usr/bin/python3
"""An independent judge: random rigs, scenes and motions, through dr_judge (judge_driver) and through this file.

    oracle.py DRIVER [--count N] [--seed FIRST]

Written from docs/guard.md, not from the C. Where the core sweeps boxes, this follows the way that the controller really
goes, in exact arithmetic on another unit (1/1024 um) and with another method (separating axes instead of slabs):

  unsafe         dr_judge allowed a motion whose real way breaks a policy: must never be
  false refusal  dr_judge refused a motion whose real way breaks none: the price of not knowing the way; told by command
  'S'            its way is known: both must agree, both ways round

Exit: 0 nothing unsafe and no disagreement about 'S', 1 there is, 2 it could not be run.
"""
import argparse
import random
import subprocess
import sys
from collections import Counter
from fractions import Fraction
from itertools import permutations

UNIT = 1024  # of this file, per um
AXES = range(3)

# um per microstep, um/s at full speed, travel in um; [T tables 4, 5, 7], [M tables 6 to 8]; numbers of dr_stage_id
STAGES = {
    1: ('trio', Fraction(6, 64), 5000, (25000, 25000, 25000)),
    2: ('trio', Fraction(6, 64), 5000, (50000, 12500, 25000)),
    3: ('trio', Fraction(8, 64), 5000, (25000, 25000, 25000)),
    5: ('mpc', Fraction(4, 64), 3000, (25000, 25000, 25000)),
    6: ('mpc', Fraction(4, 64), 5000, (25000, 25000, 25000)),
    10: ('mpc', Fraction(5, 64), 5000, (22000, 22000, 22000)),
}
MEASURED = (338, 361, 383, 412, 441, 478, 523, 573, 638, 718, 815, 958, 1139, 1404, 1890, 2767, 4650)
FULL = 16
NONE, BOX, HALF = 0, 1, 2
KNOBS_LOCKED, PATHS_UNKNOWN = 4, 8


def fastest(stage, level):
    kind, _, full, _ = STAGES[stage]
    documented = full if level >= FULL else Fraction((5000 if kind == 'trio' else 1300) * (level + 1), 16)
    return documented if kind == 'trio' else max(documented, MEASURED[min(level, FULL)])


def slowest_full(stage):
    kind, _, full, _ = STAGES[stage]
    return full if kind == 'trio' else min(full, MEASURED[FULL])


# -- Shapes in whole units ---------------------------------------------------------------------------------------------


def units(um):
    value = Fraction(um) * UNIT
    assert value.denominator == 1
    return value.numerator


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def line_meets_box(p, q, low, high):
    """Separating axes of a segment and a box: the box's three, and each crossed with the segment."""
    d = tuple(b - a for a, b in zip(p, q))
    basis = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    for axis in basis + tuple(cross(d, e) for e in basis):
        if axis == (0, 0, 0):
            continue
        of_line = sorted((dot(axis, p), dot(axis, q)))
        of_box = (sum(n * (low[i] if n > 0 else high[i]) for i, n in enumerate(axis)),
                  sum(n * (high[i] if n > 0 else low[i]) for i, n in enumerate(axis)))
        if of_line[1] < of_box[0] or of_line[0] > of_box[1]:
            return False
    return True


def line_meets(p, q, obstacle, margin):
    """Does a cube of half-side margin, carried along the line, meet the obstacle?"""
    if obstacle['shape'] == BOX:
        return line_meets_box(p, q, [v - margin for v in obstacle['min']], [v + margin for v in obstacle['max']])
    reach = obstacle['offset'] + margin * sum(abs(n) for n in obstacle['normal'])
    return min(dot(obstacle['normal'], p), dot(obstacle['normal'], q)) <= reach


# -- Where the controllers really go --------------------------------------------------------------------------------------


def towards(p, goal, axes):
    return tuple(goal[i] if i in axes else p[i] for i in AXES)


def all_at_full_speed(p, q):
    """Each axis for itself at one speed: a polyline that bends where an axis is there."""
    way = [p]
    for far in sorted({abs(b - a) for a, b in zip(p, q)} - {0}):
        way.append(tuple(a + max(-far, min(far, b - a)) for a, b in zip(p, q)))
    return way


def home_order(p, q, angle):
    xz = [(0, 2)] if angle == 45 else [(2,), (0,)] if angle < 45 else [(0,), (2,)]
    way = [p]
    for axes in xz + [(1,)]:
        way += all_at_full_speed(way[-1], towards(way[-1], q, axes))[1:]
    return way


def work_order(p, q, angle):
    between = towards(p, q, (1,))
    return [p] + home_order(between, q, angle)


def real_way(rig, motion):
    p, q = motion['start'], motion['target']
    code = motion['code']
    if code == 'S':
        return [p, q]
    if code == 'H' and rig['kind'] == 'trio':
        return home_order(p, q, motion['angle'])
    if code == 'W':
        return work_order(p, q, motion['angle'])
    return all_at_full_speed(p, q)


# -- The policies, on a real way ---------------------------------------------------------------------------------------------


def beyond(value, low, high):
    return max(low - value, 0, value - high)


def along(move, direction, tolerance):
    """Distance of the end of `move` from the line through its start, squared, against the tolerance's."""
    c = cross(move, direction)
    return dot(c, c) <= tolerance * tolerance * dot(direction, direction)


def leads_out(obstacle, p, q):
    if obstacle['shape'] == HALF:
        return dot(obstacle['normal'], q) > dot(obstacle['normal'], p)
    if obstacle['exit'] == 0:
        return False
    axis, up = (obstacle['exit'] - 1) // 2, obstacle['exit'] % 2 == 0
    step = [b - a for a, b in zip(p, q)]
    return (step[axis] > 0 if up else step[axis] < 0) and all(abs(step[i]) <= units(2) for i in AXES if i != axis)


def breaks_escape(rig, motion, margin):
    """The start is in a forbidden place: only lines up to 1 mm that shrink all that is violated and violate nothing new."""
    p, q = motion['start'], motion['target']
    move = [b - a for a, b in zip(p, q)]
    if motion['code'] != 'S' or rig['flags'] & PATHS_UNKNOWN or dot(move, move) > units(1000) ** 2:
        return 'escape'
    for o in rig['obstacles']:
        if line_meets(p, p, o, margin):
            if not leads_out(o, p, q):
                return 'escape'
        elif line_meets(p, q, o, margin):
            return 'escape'
    for i in AXES:
        was, now = beyond(p[i], rig['min'][i], rig['max'][i]), beyond(q[i], rig['min'][i], rig['max'][i])
        other_side = (p[i] < rig['min'][i]) != (q[i] < rig['min'][i])
        if now > 0 and (now >= was or other_side):
            return 'escape'
    return None


def breaks(rig, motion, way):
    """The first policy that the way breaks; None: none."""
    p, q, margin = way[0], way[-1], rig['margin']
    if rig['kind'] == 'trio' and not 0 < motion['angle'] < 90:
        return 'angle'
    outside = any(beyond(p[i], rig['min'][i], rig['max'][i]) for i in AXES)
    if outside or any(line_meets(p, p, o, margin) for o in rig['obstacles']):
        broken = breaks_escape(rig, motion, margin)
        if broken:
            return broken
    else:
        for corner in way:
            if any(beyond(corner[i], rig['min'][i], rig['max'][i]) for i in AXES):
                return 'limit'
        for a, b in zip(way, way[1:]):
            if any(line_meets(a, b, o, margin) for o in rig['obstacles']):
                return 'keep-out'
    if motion['old'] is not None:
        for order in permutations(AXES):  # the controller may resume it, in any order of its axes
            at = p
            for axis in order:
                there = towards(at, motion['old'], (axis,))
                if any(line_meets(at, there, o, margin) for o in rig['obstacles']):
                    return 'old target'
                at = there
    move = [b - a for a, b in zip(p, q)]
    if dot(move, move) > rig['max_move'] ** 2:
        return 'step'
    if rig['kind'] == 'trio' and motion['code'] != 'S':
        if Fraction(sum(map(abs, move)), UNIT) / slowest_full(rig['stage']) * 1000 > rig['unstoppable_ms']:
            return 'unstoppable'
    return breaks_surface(rig, motion, way)


def breaks_surface(rig, motion, way):
    level = motion['level'] if motion['code'] == 'S' else FULL
    cap = rig['fast']
    height = None
    if rig['retract']:
        axis, up = (rig['retract'] - 1) // 2, rig['retract'] % 2 == 0
        height = min((c[axis] - rig['surface'] if up else rig['surface'] - c[axis]) for c in way) - rig['margin']
        if height <= 0:
            cap = rig['slow']
    if cap < FULL and fastest(rig['stage'], level) > fastest(rig['stage'], cap):
        return 'speed'
    if height is None:
        return 'approach' if motion['in_tissue'] else None
    if all(along([b - a for a, b in zip(way[0], c)], rig['approach'], units(2)) for c in way):
        return None
    if motion['in_tissue']:
        return 'approach'
    return 'lateral' if height <= rig['clearance'] else None


# -- Random rigs: on coarse grids, so that faces, edges and corners are really met -------------------------------------------


def random_rig(r):
    stage = r.choice(list(STAGES))
    kind, step, _, travel = STAGES[stage]
    rig = {'stage': stage, 'kind': kind, 'step': step}
    rig['flags'] = KNOBS_LOCKED | (PATHS_UNKNOWN if r.random() < 0.1 else 0)
    rig['margin'] = units(r.choice((0, 0, 50, 100, Fraction(r.randrange(6400), 64))))
    rig['unstoppable_ms'] = r.choice((200, 60000, 60000))
    rig['min'] = [units(r.choice((0, 100, 900, 1500))) for _ in AXES]
    rig['max'] = [units(min(travel[i] - 100, r.choice((4000, 4500, 9000)))) for i in AXES]
    rig['max_move'] = units(r.choice((1000, 5000, 20000, 20000)))
    rig['fast'] = r.choice((FULL, FULL, FULL, 15, 9))
    rig['slow'] = r.randrange(rig['fast'] + 1)
    rig['retract'] = r.choice((0, 0, 0, 0, 0, 5, 6, 1))
    rig['surface'] = rig['clearance'] = 0
    rig['approach'] = (0, 0, 0)
    if rig['retract']:
        axis = (rig['retract'] - 1) // 2
        rig['surface'] = units(r.choice((1500, 2000, 3000)))
        rig['clearance'] = units(r.choice((0, 100, 300)))
        rig['approach'] = tuple(r.choice((1, -3, 700)) if i == axis else r.choice((0, 0, 1, -707)) for i in AXES)
    rig['obstacles'] = [random_obstacle(r) for _ in range(r.choice((0, 1, 1, 2, 3, 5)))]
    return rig


def grid(r):
    return units(r.randrange(20, 90) * 50)


def random_obstacle(r):
    if r.random() < 0.25:
        normal = tuple(r.choice((0, 0, 1, -1, 2, -707)) for _ in AXES)
        if normal == (0, 0, 0):
            normal = (0, 0, 1)
        at = [grid(r) for _ in AXES]
        offset = dot(normal, at) - units(r.randrange(0, 90) * 50) * sum(map(abs, normal))
        return {'shape': HALF, 'exit': 0, 'normal': normal, 'offset': offset}
    low = [grid(r) for _ in AXES]
    high = [v + units(r.choice((0, 50, 200, 500, 1500))) for v in low]
    return {'shape': BOX, 'exit': r.randrange(7), 'min': low, 'max': high}


def random_motion(r, rig):
    per_step = units(rig['step'])
    travel = [int(Fraction(t) / rig['step']) for t in STAGES[rig['stage']][3]]

    def place(i):
        near = r.choice((grid(r), grid(r), rig['min'][i], rig['max'][i])) + per_step * r.choice((0, 0, 0, 1, -1))
        return max(0, min(travel[i], near // per_step))

    for _ in range(r.choice((1, 8, 8))):  # mostly from where a tip may be
        start = [place(i) for i in AXES]
        at = tuple(v * per_step for v in start)
        if not any(beyond(at[i], rig['min'][i], rig['max'][i]) for i in AXES) and not any(
                line_meets(at, at, o, rig['margin']) for o in rig['obstacles']):
            break
    how = r.random()
    if how < 0.4:
        target = [place(i) for i in AXES]
    elif how < 0.8:
        target = [max(0, min(travel[i], start[i] + r.choice((1, 10, 30)) * r.randrange(-300, 301))) for i in AXES]
    else:  # along the approach line, to the nearest microstep
        length, d = r.randrange(-8000, 8001), rig['approach'] if any(rig['approach']) else (0, 0, 1)
        longest = max(map(abs, d))
        target = [max(0, min(travel[i], start[i] + round(Fraction(length * d[i], longest)))) for i in AXES]
    code = r.choice('SSSSHWxyz' if rig['kind'] == 'trio' else 'SSSMMM')
    if code in 'xyz':
        target = [target[i] if i == 'xyz'.index(code) else start[i] for i in AXES]
    motion = {'code': code, 'level': r.randrange(16), 'angle': r.choice((0, 1, 30, 44, 45, 46, 89, 90, 30, 60))}
    motion['in_tissue'] = r.random() < 0.05
    motion['start_steps'], motion['target_steps'] = start, target
    motion['start'] = tuple(v * per_step for v in start)
    motion['target'] = tuple(v * per_step for v in target)
    motion['old'] = tuple(place(i) * per_step for i in AXES) if r.random() < 0.1 else None
    return motion


def line_of(rig, motion):
    """The scene as judge_driver reads it, in quanta of 1/64 um: UNIT / 64 of ours each."""
    def q(value):
        assert value * 64 % UNIT == 0
        return value * 64 // UNIT
    out = [0 if rig['kind'] == 'trio' else 1, rig['stage'], rig['flags'], q(rig['margin']), rig['unstoppable_ms']]
    out += [q(v) for v in rig['min'] + rig['max']]
    out += [q(rig['max_move']), rig['fast'], rig['slow'], rig['retract'], q(rig['surface']), q(rig['clearance'])]
    out += rig['approach']
    out.append(len(rig['obstacles']))
    for o in rig['obstacles']:
        out += [o['shape'], o['exit']]
        out += [q(v) for v in o['min'] + o['max']] if o['shape'] == BOX else list(o['normal']) + [q(o['offset'])]
    out += motion['start_steps'] + [motion['angle'], int(motion['in_tissue']), int(motion['old'] is not None)]
    out += [q(v) for v in motion['old'] or (0, 0, 0)]
    out += [ord(motion['code']), motion['level']]
    only = 'xyz'.find(motion['code'])
    out += [v if only in (-1, i) else 0 for i, v in enumerate(motion['target_steps'])]
    return ' '.join(map(str, out))


def main():
    parser = argparse.ArgumentParser(description='Random scenes through dr_judge and through an independent judge.')
    parser.add_argument('driver')
    parser.add_argument('--count', type=int, default=10000)
    parser.add_argument('--seed', type=int, default=1)
    arguments = parser.parse_args()
    told, allowed, refused_safe, safe = Counter(), Counter(), Counter(), Counter()
    unsafe = disagreed = bad = done = 0
    while done < arguments.count:
        cases = []
        for _ in range(min(1000, arguments.count - done)):
            r = random.Random(arguments.seed + done)
            rig = random_rig(r)
            cases.append((arguments.seed + done, rig, random_motion(r, rig)))
            done += 1
        lines = '\n'.join(line_of(rig, motion) for _, rig, motion in cases) + '\n'
        ran = subprocess.run([arguments.driver], input=lines, stdout=subprocess.PIPE, text=True)
        answers = ran.stdout.splitlines()
        if ran.returncode or len(answers) != len(cases):
            print(f'oracle: {arguments.driver} ended with {ran.returncode} after {len(answers)} answers', file=sys.stderr)
            return 2
        for (seed, rig, motion), answer in zip(cases, answers):
            if answer.startswith('bad'):  # limits that no guard would load: an obstacle over the whole box, say
                bad += 1
                continue
            broken = breaks(rig, motion, real_way(rig, motion))
            passes = answer.split()[0] == '0'
            code = motion['code']
            told[code] += 1
            allowed[code] += passes
            safe[code] += broken is None
            refused_safe[code] += broken is None and not passes
            if passes and broken:
                unsafe += 1
                print(f'UNSAFE seed {seed}: {code} was allowed and breaks {broken}\n  {line_of(rig, motion)}')
            elif code == 'S' and not rig['flags'] & PATHS_UNKNOWN and passes != (broken is None):
                # What is resumed after a stop may go any way, so its hull counts: stricter than the orders tried here.
                if motion['old'] is None:
                    disagreed += 1
                    print(f'DISAGREE seed {seed}: S refused for reason {answer}, breaks nothing\n  {line_of(rig, motion)}')
    print(f'{done} scenes, {bad} of them with limits that are no limits; unsafe allowed: {unsafe}; '
          f'disagreements about S: {disagreed}')
    for code in sorted(told):
        rate = 100 * refused_safe[code] / max(1, safe[code])
        print(f'  {code}: {told[code]} judged, {allowed[code]} allowed, {safe[code]} safe; '
              f'false refusals: {refused_safe[code]} ({rate:.1f} % of the safe)')
    return 1 if unsafe or disagreed or sum(allowed.values()) * 20 < done else 0


if __name__ == '__main__':
    sys.exit(main())
