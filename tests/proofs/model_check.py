#!/usr/bin/python3
"""Runs the proofs of this directory with the model checker CBMC.

    model_check.py CBMC WORK [--only WORD] [--jobs N] [--seconds N] [--no-plants] [--list]

CBMC is a directory with the programs cbmc, goto-cc and goto-instrument (scripts/setup prove); WORK keeps logs, and the results
by the contents of what was proved: what has not changed is not proved again. The end of each proof must be reachable (the one
assertion that fails), else nothing meets what it assumes and it proves nothing.

A `plant` is a fault that is put into a copy of the core: the proof must find it.

Exit: 0 all hold and all plants are found; 1 one does not, or is not decided within --seconds; 2 it could not be run.
"""
import argparse
import concurrent.futures
import hashlib
import json
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
CORE = HERE.parents[1] / 'firmware' / 'core'

WIRE = ('dr_device.c', 'dr_wire.c')
# dr_guard.c is included by the proof, for what is private to it; the seal is replaced by one that is whole.
GUARD = WIRE + ('dr_geometry.c',) + tuple(sorted(p.name for p in CORE.glob('dr_guard_*.c') if p.name != 'dr_guard_seal.c'))


class Proof:
    """One theorem: an entry point of a file of this directory. `without` names functions of the core that may do and answer
    anything there; `loops` bounds single loops (CBMC proves that no bound is too small); `plant` is (file, old, new)."""

    def __init__(self, file, entry='main', name=None, sources=WIRE, without=(), define=(), unwind=32, loops=(), plant=None):
        self.file, self.entry, self.sources, self.without = file, entry, sources, without
        self.define, self.unwind, self.loops, self.plant = define, unwind, loops, plant
        self.name = name or f'{Path(file).stem}-{entry.removeprefix("proof_")}'


def guard(entry, name=None, define=(), plant=None, loops=()):
    return Proof('guard.c', f'proof_{entry}', f'guard-{name or entry}', GUARD, ('begin',), define, loops=loops, plant=plant)


def judge(entry, drive, without=(), plant=None):
    return Proof('judge.c', f'proof_{entry}', f'judge-{entry}-{drive}', WIRE, without, (f'DR_PROOF_DRIVE={drive}',), unwind=20,
                 plant=plant)


OTHER_POLICIES = ('judge_old_moves', 'judge_step', 'judge_time', 'judge_surface')
TASKS = ('none', 'prove', 'arm', 'pass', 'recheck', 'check', 'send', 'move', 'verify', 'stop')
TIMERS = ('frame', 'resync', 'task', 'read', 'send', 'proof', 'repeat', 'idle', 'rate', 'noise', 'stale', 'wiring', 'release', 'line')

PROOFS = [guard(*case) for case in (
    ('start',),
    ('pulled_byte', None, (), ('dr_guard.c', 'if (g->stops_out > 0 && !is_leaving(g))', 'if (g->stops_out > 0)'),
     ('dr_guard_pull_device.0:4',)),
    ('bytes_for_the_host',),
    ('person', None, (), ('dr_guard_people.c', '!g->stop_latched && !g->wiring_alarm', '!g->wiring_alarm')),
    ('cable', None, (), ('dr_guard_people.c', 'g->out_at = g->out_count = g->out_ready = g->stops_out = 0;', '')),
    ('line_error_or_damage', None, (), ('dr_guard_stop.c', 'dr_g_lock(g, DR_FAULT_DAMAGED);', '')),
)] + [
    guard('device_byte', f'device_byte-{task}', (f'DR_PROOF_TASK=TASK_{task.upper()}',),
          ('dr_guard_motion.c', 'verdict.reason != DR_REASON_NONE', 'verdict.reason == DR_REASON_RANGE') if task == 'check' else None,
          ('rest_proved.0:257',)) for task in TASKS
] + [
    guard('timer', f'timer-{timer}', (f'DR_PROOF_TIMER=DR_TIMER_{timer.upper()}',)) for timer in TIMERS
] + [
    guard('host_byte', f'host_byte-{task}', (f'DR_PROOF_TASK=TASK_{task.upper()}',),
          ('dr_guard_host.c', ' || is_leaving(g)', '') if task == 'none' else None) for task in TASKS
] + [judge(*case) for drive in (0, 3) for case in (
    ('path', drive, (), ('dr_judge.c', '(axis == DR_Y) == y_first', '(axis == DR_Y) != y_first')),
    ('box', drive, OTHER_POLICIES, ('dr_judge.c', 'return refuse(DR_REASON_LIMIT, axis, box_q->max_q[axis], allowed_q->max_q[axis]);', ';')),
    ('keep_out', drive, (), ('dr_judge.c', 'dr_box_grown(&o->box_q, margin_q);', 'dr_box_grown(&o->box_q, 0);')),
)] + [
    judge('escape', 0, (), ('dr_judge.c', 'is > 0 && is >= was', 'is > 0 && is > was')),
    Proof('codec.c', plant=('dr_wire.c', '<< (8u * i)', '<< (7u * i)')),
    Proof('framer.c', plant=('dr_wire.c', 'framer->have < framer->want', 'framer->have <= framer->want')),
] + [Proof('geometry.c', f'proof_{entry}', sources=('dr_geometry.c',), plant=plant) for entry, plant in (
    ('boxes', ('dr_geometry.c', 'b->min_q[axis] || a->min_q', 'b->min_q[axis] && a->min_q')),
    ('half', ('dr_geometry.c', 'box->min_q[axis] : box->max_q', 'box->max_q[axis] : box->max_q')),
    ('widths', None),
)]


class Undecided(Exception):
    pass


def programs(directory):
    found = {name: Path(directory) / name for name in ('cbmc', 'goto-cc', 'goto-instrument')}
    missing = [str(path) for path in found.values() if not path.is_file()]
    if missing:
        print(f'model_check: there is no {missing[0]}: run scripts/setup prove', file=sys.stderr)
        sys.exit(2)
    return found


def run(command, log, seconds):
    try:
        with open(log, 'a', encoding='utf-8') as out:
            return subprocess.run([str(word) for word in command], stdout=out, stderr=subprocess.STDOUT, timeout=seconds).returncode
    except subprocess.TimeoutExpired as late:
        raise Undecided(f'not decided within {seconds} s') from late


REACHED = 'proved.assertion.1'  # of proof.h: the end


def failures(tools, proof, core, work, seconds):
    """The properties that do not hold. Undecided: nobody knows."""
    work.mkdir(parents=True, exist_ok=True)
    log, program = work / 'log', work / 'program'
    log.write_text('')
    compile_ = [tools['goto-cc'], '-std=c99', f'-I{core}', f'-I{HERE}', *(f'-D{define}' for define in proof.define), HERE / proof.file,
                *(core / source for source in proof.sources), '--function', proof.entry, '-o', program]
    if run(compile_, log, seconds):
        raise Undecided(f'it does not compile, see {log}')
    for function in proof.without:
        for option in (('--remove-function-body', function),
                       ('--generate-function-body', function, '--generate-function-body-options', 'nondet-return')):
            if run([tools['goto-instrument'], *option, program, f'{program}.next'], log, seconds):
                raise Undecided(f'{function} cannot be left out, see {log}')
            Path(f'{program}.next').replace(program)
    check = [tools['cbmc'], program, '--unwind', proof.unwind, '--unwinding-assertions', '--object-bits', 10]
    if proof.loops:
        check += ['--unwindset', ','.join(proof.loops)]
    run(check, log, seconds)
    said = log.read_text(errors='replace')
    failed = set(re.findall(r'^\[(\S+)\].*: FAILURE$', said, re.M))
    if not re.search(r'^VERIFICATION (SUCCESSFUL|FAILED)$', said, re.M):
        raise Undecided(f'the model checker gave up, see {log}')
    if any('.no-body.' in name or '.unwind.' in name for name in failed):
        raise Undecided(f'a function or a loop is not covered, see {log}')
    return failed


def planted(plant, directory):
    file, old, new = plant
    shutil.rmtree(directory, ignore_errors=True)
    shutil.copytree(CORE, directory)
    text = (directory / file).read_text()
    if old not in text:
        raise Undecided(f'the plant no longer fits {file}: {old!r}')
    (directory / file).write_text(text.replace(old, new, 1))
    return directory


def with_included(paths):
    """The files, and those of ours that they include."""
    found, left = set(), list(paths)
    while left:
        path = left.pop()
        if path not in found:
            found.add(path)
            names = re.findall(r'^#include "(.+)"', path.read_text(), re.M)
            left += [at / name for name in names for at in (HERE, CORE) if (at / name).is_file()]
    return sorted(found)


def fingerprint(proof):
    text = hashlib.sha256(repr(vars(proof)).encode())
    for path in with_included([HERE / proof.file, *(CORE / source for source in proof.sources)]):
        text.update(path.read_bytes())
    return text.hexdigest()


def prove(tools, proof, work, seconds):
    """What came of one proof, as kept in WORK."""
    kept = work / f'{proof.name}.json'
    print_of_it = fingerprint(proof)
    if kept.is_file():
        result = json.loads(kept.read_text())
        if result['fingerprint'] == print_of_it and result['result'] == 'holds':
            return result
    began = time.monotonic()
    directory = work / proof.name
    try:
        failed = failures(tools, proof, CORE, directory / 'proof', seconds)
        if failed - {REACHED}:
            result = f'DOES NOT HOLD, see {directory}/proof/log'
        elif not failed:
            result = 'PROVES NOTHING: nothing meets what it assumes'
        elif proof.plant and not failures(tools, proof, planted(proof.plant, directory / 'core'), directory / 'plant', seconds) - {REACHED}:
            result = f'DOES NOT FIND {proof.plant[1]!r} -> {proof.plant[2]!r} in {proof.plant[0]}'
        else:
            result = 'holds'
    except Undecided as why:
        result = f'UNDECIDED: {why}'
    result = {'name': proof.name, 'result': result, 'seconds': round(time.monotonic() - began), 'fingerprint': print_of_it,
              'plant': bool(proof.plant)}
    if result['result'] == 'holds':
        shutil.rmtree(directory, ignore_errors=True)
    kept.write_text(json.dumps(result))
    return result


def main():
    parser = argparse.ArgumentParser(description='Model checking of the core.')
    parser.add_argument('cbmc')
    parser.add_argument('work', type=Path)
    parser.add_argument('--only', default='', help='proofs with this in their name')
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--seconds', type=int, default=1800, help='for each run of the model checker')
    parser.add_argument('--no-plants', action='store_true', help='do not look whether faults are found: half the time')
    parser.add_argument('--list', action='store_true', help='name the proofs, and run none')
    arguments = parser.parse_args()
    chosen = [proof for proof in PROOFS if arguments.only in proof.name]
    if arguments.no_plants:
        for proof in chosen:
            proof.plant = None
    if not chosen:
        parser.error(f'no proof has {arguments.only!r} in its name')
    if arguments.list:
        print('\n'.join(proof.name for proof in chosen))
        return 0
    tools = programs(arguments.cbmc)
    arguments.work.mkdir(parents=True, exist_ok=True)
    results = []
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        running = [pool.submit(prove, tools, proof, arguments.work, arguments.seconds) for proof in chosen]
        for done in concurrent.futures.as_completed(running):
            result = done.result()
            results.append(result)
            print(f"{result['name']}: {result['result']} ({result['seconds']} s)", flush=True)
    good = [result for result in results if result['result'] == 'holds']
    print(f'{len(good)} of {len(results)} proofs hold, {sum(r["plant"] for r in good)} of them found a fault that was put in, '
          f'{sum(r["seconds"] for r in results)} s in all')
    return 0 if len(good) == len(results) else 1


if __name__ == '__main__':
    sys.exit(main())
