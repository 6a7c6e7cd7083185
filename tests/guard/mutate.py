#!/usr/bin/python3
"""Mutation testing of the guard's core: are its tests able to fail?

    mutate.py WORK [--sample N] [--seed S] [--only WORD] [--jobs N] [--report FILE] [--again] [--quick]

Every mutant (mutants.py tells what that is) of dr_geometry, dr_limits, dr_judge, dr_log and dr_guard is compiled, put in
the place of the module in the test programs of this directory, and run, each program a fresh process, until one fails:

  killed     a test failed                    crashed   a program ended by a signal or a sanitizer
  timeout    a program used many times the processor time that it needs (not wall-clock time: a busy machine changes nothing)
  survived   no program noticed, the last time with address and undefined-behaviour sanitizers
  identical  survived, and is the same machine code as the original at -O2: no mutant at all
  stillborn  does not compile

equivalents.txt names the survivors that no test can kill, and argues each. Results are kept in the directory WORK, by the
contents of what was compiled and run: what did not change is not run again.

  --sample   so many, drawn by a hash of what they change: the same ones as long as their lines stay as they are
  --only     mutants of the files, functions or lines that have this in them
  --again    only what the run before did not kill
  --quick    without sanitizers and the longest tests: a first look, of which nothing is kept but kills

Exit: 0 at least 97 % of what is left without the argued ones are found (of a sample, which cannot tell 97 from 95: 90 %), and the
list holds; 1 not; 2 nothing was measured:
the tests fail without a mutant, or a program ended well without having run its tests.
"""
import argparse
import fcntl
import hashlib
import json
import multiprocessing
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from datetime import datetime, timezone
from pathlib import Path

from mutants import mutants_of

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
CORE = ROOT / 'firmware' / 'core'
UNITY = ROOT / '.deps' / 'unity'
MUTATED = ('dr_geometry', 'dr_limits', 'dr_judge', 'dr_log', 'dr_guard')
GATE, GATE_OF_SAMPLE = 97, 90
FLAGS = ['-std=c99', '-w', '-fPIC', f'-I{CORE}', f'-I{UNITY}', f'-I{HERE}']
TCC = shutil.which('tcc') or 'gcc'  # ten times as fast as gcc; what it makes is half as fast: for tests that are swift
SWIFT = 0.004  # seconds that a test takes: these come first
LONG = 0.1     # these come last, and not with sanitizers
QUICK = ['-O1']
SAFE = ['-O1', '-fsanitize=address,undefined,bounds-strict', '-fno-sanitize-recover=all']
ENVIRONMENT = {'LD_BIND_NOW': '1', 'ASAN_OPTIONS': 'detect_leaks=0:detect_stack_use_after_return=1', 'PATH': os.environ['PATH']}
WRAP = '-Wl,--wrap=UnityDefaultTestRun'
SUMMARY = re.compile(rb'^(\d+) Tests (\d+) Failures', re.M)
FOUND = ('killed', 'crashed', 'timeout')


# -- What there is: modules and test programs, as CMake builds them ----------------------------------------------------------

class Project:
    def __init__(self):
        self.uses, self.sources = {}, {}
        for name, rest in re.findall(r'^dr_core_module\((\w+)([^)]*)\)', (CORE / 'CMakeLists.txt').read_text(), re.M):
            uses, _, rooms = rest.partition('ROOMS')
            self.uses[name] = uses.split()
            self.sources[name] = [CORE / f'{source}.c' for source in (name, *rooms.split())]
        listed = (HERE / 'CMakeLists.txt').read_text()
        libraries = {name: (sources.split(), uses.split()) for name, sources, uses in re.findall(
            r'add_library\((\w+) STATIC ([^)]*)\)\s*target_link_libraries\(\1 PUBLIC ([^)]*)\)', listed)}
        self.programs = {}
        for name, sources, uses in re.findall(r'^dr_test\((\w+) SOURCES ([^)]*?) LIBS ([\w ]*?)(?: TIMEOUT \d+)?\)', listed, re.M):
            files, modules, wanted = sources.split(), set(), uses.split()
            while wanted:
                use = wanted.pop()
                if use in libraries:
                    files += [file for file in libraries[use][0] if file.endswith('.c')]
                    wanted += libraries[use][1]
                elif use in self.uses and use not in modules:
                    modules.add(use)
                    wanted += self.uses[use]
            self.programs[name] = ([HERE / file for file in files] + [HERE / 'pick_tests.c', UNITY / 'unity.c'], modules)
        if not self.programs or any(name not in self.uses for name in MUTATED):
            raise SystemExit('mutate: cannot read CMakeLists.txt of this directory or of firmware/core')

    def mutated(self, module):
        """Its files; of a public header only what functions do: tests are compiled with its constants."""
        return [*self.sources[module], CORE / f'{module}.h', *sorted(CORE.glob(f'{module}_*.h'))]

    def print_of(self, program):
        """A hash of all that a program is made of."""
        files, modules = self.programs[program]
        inputs = sorted(CORE.glob('*.h')) + sorted(HERE.glob('*.h')) + files
        inputs += [source for module in sorted(modules) for source in self.sources[module]]
        text = [' '.join([TCC] + FLAGS[:3] + QUICK + SAFE)] + [path.name + path.read_text() for path in inputs]
        return hashlib.sha256('\0'.join(text).encode()).hexdigest()


# -- Compiling and running -----------------------------------------------------------------------------------------------------

def compiles(arguments, cwd=None, compiler='gcc', quiet=True):
    return subprocess.run([compiler] + FLAGS + arguments, cwd=cwd, stderr=subprocess.DEVNULL if quiet else None).returncode == 0


def must(compiled):
    if not compiled:
        sys.exit(2)


def build(project, at, flags):
    """A library of every module, and the programs, which find them at run time."""
    at.mkdir(parents=True, exist_ok=True)
    for module, sources in project.sources.items():
        objects = [str(at / f'{source.stem}.o') for source in sources]
        for source, to in zip(sources, objects):
            must(compiles(flags + ['-c', str(source), '-o', to], quiet=False))
        must(compiles(flags + ['-shared', '-o', str(at / f'lib{module}.so')] + objects, quiet=False))
    for program, (files, modules) in project.programs.items():
        objects = []
        for file in files:
            objects.append(str(at / f'{file.stem}.o'))
            if not os.path.exists(objects[-1]):
                must(compiles(flags + ['-c', str(file), '-o', objects[-1]], quiet=False))
        must(compiles(flags + [WRAP, '-o', str(at / program)] + objects + ['-Wl,--no-as-needed', f'-L{at}'] +
                      [f'-l{module}' for module in sorted(modules)], quiet=False))


def functions_of(project, at):
    """Program -> test -> the functions of the core that it runs through."""
    at.mkdir(parents=True, exist_ok=True)
    functions = {}
    for module in project.sources.values():
        for source in module:
            must(compiles(['-finstrument-functions', '-c', str(source), '-o', str(at / f'{source.stem}.o')], quiet=False))
    for program, (files, modules) in project.programs.items():
        core = [str(at / f'{source.stem}.o') for module in modules for source in project.sources[module]]
        must(compiles(['-no-pie', WRAP, '-o', str(at / program)] + [str(file) for file in files] + core, quiet=False))
        symbols = subprocess.run(['nm', str(at / program)], capture_output=True, text=True, check=True).stdout
        names = {int(line[0], 16): line[2] for line in map(str.split, symbols.splitlines()) if len(line) == 3 and line[1] in 'tT'}
        functions[program] = [sorted({names[int(address, 16)] for address in addresses})
                              for _, addresses in traced(program, at / program, [])]
    return functions


def traced(program, path, libraries):
    """For every test of a program, in order: its processor time in seconds, the addresses of functions."""
    trace = path.with_suffix('.trace')
    trace.unlink(missing_ok=True)
    end, tests, _ = run(path, libraries, 600, TRACE=str(trace))
    lines = [line.split() for line in trace.read_text().splitlines()] if trace.exists() else []
    if end != 'well' or tests == 0 or tests != len(lines):
        print(f'mutate: {program} ends {end} with {tests} tests run, without a mutant', file=sys.stderr)
        sys.exit(2)
    return [(int(line[1]) / 1e6, line[2:]) for line in lines]


def run(program, libraries, seconds, **more):
    """How it ended ('well' for without a finding), how many tests it ran, its processor time."""
    def limit():
        signal.setitimer(signal.ITIMER_PROF, seconds)  # of its own processor time; it outlives exec()
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = dict(ENVIRONMENT, LD_LIBRARY_PATH=':'.join(str(path) for path in libraries), **more)
    try:
        done = subprocess.run([str(program)], env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              timeout=600, preexec_fn=limit)
    except subprocess.TimeoutExpired:
        return 'timeout', 0, 600
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    summary = SUMMARY.search(done.stdout)
    tests = int(summary.group(1)) if summary else 0
    if done.returncode == 127:
        raise RuntimeError(done.stderr.decode())
    if done.returncode == -signal.SIGPROF:
        return 'timeout', tests, used
    if done.returncode < 0 or done.returncode > 0 and not summary:
        return 'crashed', tests, used
    return ('killed' if done.returncode else 'well'), tests, used


def ready(project, at):
    """Builds what is missing, once, and tells what is known of it. Waits for who is at it already.

    quick, safe: program -> seconds of each of its tests, every one of which passes alone too; trace: see functions_of()."""
    at.parent.mkdir(parents=True, exist_ok=True)
    known = at.with_suffix('.json')
    with open(at.with_suffix('.lock'), 'w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not known.exists() and at.name == 'trace':
            known.write_text(json.dumps(functions_of(project, at)))
        elif not known.exists():
            build(project, at, QUICK if at.name == 'quick' else SAFE)
            seconds = {program: [used for used, _ in traced(program, at / program, [at])]
                       for program in project.programs}
            for program, tests in seconds.items() if at.name == 'quick' else ():
                for i in range(len(tests)):
                    if run(at / program, [at], 600, PICK='0' * i + '1')[:2] != ('well', 1):
                        print(f'mutate: a test of {program}, number {i + 1}, does not pass alone', file=sys.stderr)
                        sys.exit(2)
            known.write_text(json.dumps(seconds))
        return json.loads(known.read_text())


class Bench:
    """Where one mutant after the other is tried."""

    def __init__(self, project, base, at, is_quick=False):
        self.project, self.base, self.at, self.is_quick = project, base, at, is_quick
        at.mkdir(parents=True, exist_ok=True)
        self.needs = {'quick': ready(project, base / 'quick')}
        self.runs = ready(project, base / 'trace')

    def libraries(self, module, name, text, kind, compiler, flags):
        """The module with this file in the place of the one of its name; every module, if it is a header."""
        shutil.rmtree(self.at / kind, ignore_errors=True)
        (self.at / kind).mkdir()
        if name.endswith('.c'):
            (self.at / name).write_text(text)
            others = [str(self.base / kind / f'{path.stem}.o') for path in self.project.sources[module] if path.name != name]
            return compiles(flags + ['-shared', '-o', str(self.at / kind / f'lib{module}.so'), str(self.at / name)] + others,
                            compiler=compiler)
        shutil.copytree(CORE, self.at / 'core', dirs_exist_ok=True)
        (self.at / 'core' / name).write_text(text)
        return all(compiles(flags + ['-shared', '-o', str(self.at / kind / f'lib{module}.so')] +
                            [str(self.at / 'core' / path.name) for path in self.project.sources[module]], compiler=compiler)
                   for module in MUTATED)

    def plan(self, module, function, kind, least, most):
        """(processor time, program, which of its tests): those that run through the function and take so long."""
        plan = []
        for program, (_, modules) in self.project.programs.items():
            if module in modules:
                pick = [(function == '(file)' or function in functions) and least <= used < most
                        for functions, used in zip(self.runs[program], self.needs['quick'][program])]
                seconds = sum(used for used, picked in zip(self.needs[kind][program], pick) if picked)
                if any(pick):
                    plan.append((seconds, program, ''.join('01'[picked] for picked in pick)))
        return sorted(plan)

    def verdict(self, plan, kind):
        for seconds, program, pick in plan:
            end, ran, _ = run(self.base / kind / program, [self.at / kind, self.base / kind], 8 * seconds + 0.2, PICK=pick)
            if end != 'well':
                return end, program
            if ran != pick.count('1'):
                return 'untested', program
        return 'survived', ''

    def is_identical(self, name, text):
        place = self.at / 'same'
        shutil.copytree(CORE, place, dirs_exist_ok=True)
        affected = [name] if name.endswith('.c') else [path.name for module in MUTATED for path in self.project.sources[module]]
        for source in affected:
            objects = []
            for content in ((CORE / name).read_text(), text):
                (place / name).write_text(content)
                compiles(['-O2', '-c', source, '-o', 'object.o'], cwd=place)
                objects.append((place / 'object.o').read_bytes())
            if objects[0] != objects[1]:
                return False
        return True

    def fate(self, module, name, function, text, first=''):
        """first: the program that killed it when it was tried before, which most likely does so again."""
        function = function.split(' ')[0]
        tries = [(TCC, [], 0, SWIFT, None), ('gcc', QUICK, SWIFT, LONG if self.is_quick else 1000, None)]
        for compiler, flags, least, most, only in [(TCC, [], 0, LONG, first)] * bool(first) + tries:
            if not self.libraries(module, name, text, 'quick', compiler, flags):
                return 'stillborn', ''
            plan = [step for step in self.plan(module, function, 'quick', least, most) if only in (None, step[1])]
            fate, by = self.verdict(plan, 'quick')
            if fate != 'survived':
                return fate, by
        if self.is_identical(name, text):
            return 'identical', ''
        if self.is_quick:
            return 'survived', ''
        self.needs['safe'] = ready(self.project, self.base / 'safe')
        if not self.libraries(module, name, text, 'safe', 'gcc', SAFE):
            raise RuntimeError(f'{name} compiles without sanitizers only')
        return self.verdict(self.plan(module, function, 'safe', 0, LONG), 'safe')


def prepare(project, work):
    """The programs without a mutant must end well, the modules compiled as mutants are."""
    prints = {program: project.print_of(program) for program in project.programs}
    base = work / ('base-' + hashlib.sha256(''.join(sorted(prints.values())).encode()).hexdigest()[:16])
    for old in work.glob('base-*'):
        if old != base:
            shutil.rmtree(old)
    control = Bench(project, base, work / 'control')
    fate, by = control.fate(MUTATED[0], 'dr_device.h', '(file)', (CORE / 'dr_device.h').read_text() + '\n')
    if fate != 'identical':
        print(f'mutate: without a mutant it is {fate} by {by}', file=sys.stderr)
        sys.exit(2)
    return base, prints


# -- What is known already -------------------------------------------------------------------------------------------------------

def mutated(mutant):
    """The whole file, and its name by content."""
    if mutant.file not in originals:
        originals[mutant.file] = (CORE / mutant.file).read_text()
    text = mutant.apply(originals[mutant.file])
    return text, hashlib.sha256((mutant.file + '\0' + text).encode()).hexdigest()


originals = {}


class Memory:
    """Fates by content: a kill holds as long as the program that killed is made of the same, the rest as long as all are."""

    def __init__(self, work, project, prints):
        self.file, self.prints = work / 'fates.jsonl', prints
        self.users = {module: ''.join(prints[program] for program, (_, modules) in sorted(project.programs.items()) if module in modules)
                      for module in MUTATED}
        self.known, self.before = {}, {}
        if self.file.exists():
            for line in self.file.read_text().splitlines():
                entry = json.loads(line)
                self.known[entry['mutant']] = entry
                self.before[tuple(entry['key'])] = (entry['fate'], entry['by'])

    def basis(self, module, by):
        return hashlib.sha256((self.prints[by] if by else self.users[module]).encode()).hexdigest()

    def recall(self, module, mutant):
        entry = self.known.get(mutated(mutant)[1])
        return (entry['fate'], entry['by']) if entry and entry['by'] in (*self.prints, '') and \
            entry['basis'] == self.basis(module, entry['by']) else None

    def keep(self, module, mutant, fate, by):
        entry = {'mutant': mutated(mutant)[1], 'key': mutant.key, 'fate': fate, 'by': by, 'basis': self.basis(module, by)}
        with open(self.file, 'a') as out:
            out.write(json.dumps(entry) + '\n')


def read_equivalents(path):
    """Key -> why. Entries are parted by empty lines: file and function, '- ' the line, '+ ' the mutant, why."""
    equivalents = {}
    for entry in re.split(r'\n\s*\n', re.sub(r'^#.*\n', '', path.read_text(), flags=re.M)):
        lines = entry.strip().splitlines()
        if not lines:
            continue
        if len(lines) < 4 or not lines[1].startswith('- ') or not lines[2].startswith('+'):
            raise SystemExit(f"mutate: {path.name}: not 'FILE FUNCTION', '- LINE', '+ MUTANT', WHY:\n{entry}")
        file, function = lines[0].split(' ', 1)
        key = (file, function, lines[1][2:].strip(), lines[2][1:].strip())
        if key in equivalents:
            raise SystemExit(f'mutate: {path.name} has this twice:\n{entry}')
        equivalents[key] = ' '.join(lines[3:])
    return equivalents


# -- The whole --------------------------------------------------------------------------------------------------------------------

bench = None


def start_worker(*arguments):
    global bench
    bench = Bench(Project(), *arguments)
    bench.at = bench.at / str(os.getpid())
    bench.at.mkdir(parents=True)


def try_one(task):
    index, module, mutant, first = task
    return index, *bench.fate(module, mutant.file, mutant.function, mutated(mutant)[0], first)


def as_text(mutant):
    return f'{mutant.file} {mutant.function}\n- {mutant.before}\n+ {mutant.after}\n'


def commit_of_core():
    def git(*arguments):
        return subprocess.run(['git', '-C', str(ROOT), *arguments], capture_output=True, text=True).stdout.strip()
    return git('log', '-1', '--format=%h', '--', 'firmware/core') + (' and changes that are not committed' if git('status', '--short', '--', 'firmware/core') else '')


def report(path, results, equivalents, lines, is_quick):
    files = sorted({mutant.file for _, mutant, _ in results})
    classes = ('killed', 'crashed', 'timeout', 'survived', 'identical', 'stillborn')
    out = ['# Mutation testing of the guard\'s core', '',
           f'Written by `tests/guard/mutate.py` on {datetime.now(timezone.utc):%Y-%m-%d}; `firmware/core` as of commit {commit_of_core()}.',
           *(['A first look (--quick): without sanitizers and without tests of more than 0.1 s, which find some of the survivors, but for',
              'what a run with them had found before.'] if is_quick else []),
           'What is changed and what the classes mean stands at the head of `mutants.py` and of `mutate.py`.', '', *lines, '',
           '| file | ' + ' | '.join(classes) + ' | of the survivors argued |', '|---' * (len(classes) + 2) + '|']
    for file in files + ['all']:
        mine = [(mutant, fate) for _, mutant, fate in results if file in (mutant.file, 'all')]
        counts = [str(sum(fate == name for _, fate in mine)) for name in classes]
        argued = sum(fate == 'survived' and mutant.key in equivalents for mutant, fate in mine)
        out.append(f'| {file} | ' + ' | '.join(counts) + f' | {argued} |')
    left = [mutant for _, mutant, fate in results if fate == 'survived' and mutant.key not in equivalents]
    out += ['', '## Survivors', '',
            'The argued ones are in `equivalents.txt`, each with its argument. ' + ('The others:' if left else 'There are no others.')]
    out += ['', '```', '\n'.join(as_text(mutant) for mutant in left).rstrip(), '```'] if left else []
    path.write_text('\n'.join(out) + '\n')


def main():
    parser = argparse.ArgumentParser(description='Mutation testing of the guard.')
    parser.add_argument('work', type=Path)
    parser.add_argument('--sample', type=int, default=0)
    parser.add_argument('--seed', default='1')
    parser.add_argument('--only', default='')
    parser.add_argument('--jobs', type=int, default=os.cpu_count())
    parser.add_argument('--report', type=Path)
    parser.add_argument('--again', action='store_true')
    parser.add_argument('--quick', action='store_true')
    arguments = parser.parse_args()
    os.nice(10)  # others keep time
    work = arguments.work.resolve()
    work.mkdir(parents=True, exist_ok=True)
    project = Project()
    base, prints = prepare(project, work)
    memory = Memory(work, project, prints)
    everything = [(module, mutant) for module in MUTATED for source in project.mutated(module)
                  for mutant in mutants_of(source.name, source.read_text(), source.stem != module or source.suffix == '.c')]
    equivalents = read_equivalents(HERE / 'equivalents.txt')
    wrong = [f'names no mutant: {" | ".join(key)}' for key in equivalents.keys() - {mutant.key for _, mutant in everything}]

    chosen = [(module, mutant) for module, mutant in everything if arguments.only in ' '.join(mutant.key) and
              (not arguments.again or memory.before.get(mutant.key, ('survived',))[0] == 'survived')]
    if arguments.sample:
        def lot(pair):
            return hashlib.sha256((arguments.seed + '\0'.join(pair[1].key)).encode()).hexdigest()
        chosen = sorted(sorted(chosen, key=lot)[:arguments.sample], key=lambda pair: pair[1].key)
    results, tasks = [], []
    for index, (module, mutant) in enumerate(chosen):
        known = memory.recall(module, mutant)
        results.append((module, mutant, known[0] if known else None))
        if not known:
            tasks.append((index, module, mutant, memory.before.get(mutant.key, ('', ''))[1]))  # what killed it before comes first
    print(f'{len(everything)} mutants, {len(chosen)} of them chosen, {len(tasks)} of these to be run', flush=True)
    began = last = time.monotonic()
    with multiprocessing.Pool(arguments.jobs, start_worker, (base, work / 'workers', arguments.quick)) as pool:
        for count, (index, fate, by) in enumerate(pool.imap_unordered(try_one, tasks, chunksize=4)):
            module, mutant, _ = results[index]
            results[index] = (module, mutant, fate)
            if fate != 'survived' or not arguments.quick:
                memory.keep(module, mutant, fate, by)
            if fate == 'survived' and mutant.key not in equivalents:
                print('survived, ' + f'line {mutant.line}: ' + as_text(mutant), flush=True)
            if time.monotonic() - last > 60:
                last = time.monotonic()
                print(f'{count + 1} of {len(tasks)} after {last - began:.0f} s', flush=True)
    shutil.rmtree(work / 'workers', ignore_errors=True)
    return judge(arguments, results, equivalents, wrong)


def judge(arguments, results, equivalents, wrong):
    counts = {}
    for _, mutant, fate in results:
        counts[fate] = counts.get(fate, 0) + 1
        if fate not in ('survived', 'identical') and mutant.key in equivalents:
            wrong.append(f'is {fate}: {" | ".join(mutant.key)}')
    survived = [mutant for _, mutant, fate in results if fate == 'survived']
    left = [mutant for mutant in survived if mutant.key not in equivalents]
    found = sum(counts.get(fate, 0) for fate in FOUND)
    tried, unargued = found + len(survived), found + len(left)
    if counts.get('untested') or tried == 0:
        print(f'mutate: {counts.get("untested", 0)} mutants of {tried} ended well without all tests run', file=sys.stderr)
        return 2
    lines = [f'{found} of {tried} mutants were found: **{100 * found / tried:.2f} %**. Without the {len(survived) - len(left)} that are '
             f'argued to be equivalent: **{100 * found / max(1, unargued):.2f} %**, {len(left)} are open. '
             f'Identical machine code (not counted): {counts.get("identical", 0)}.']
    print(', '.join(f'{count} {fate}' for fate, count in sorted(counts.items())))
    print(lines[0].replace('**', ''))
    for error in wrong:
        print(f'mutate: equivalents.txt: {error}', file=sys.stderr)
    if arguments.report:
        report(arguments.report, results, equivalents, lines, arguments.quick)
    gate = GATE_OF_SAMPLE if arguments.sample else GATE
    return 0 if found * 100 >= gate * unargued and not wrong else 1


if __name__ == '__main__':
    sys.exit(main())
