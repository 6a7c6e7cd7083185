#!/usr/bin/python3
"""Mutation testing of the guard: are its tests able to fail?

    mutate.py BUILD [--sample N] [--seed S] [--only FILE] [--report FILE]

BUILD is a configured build directory of this project whose compile_commands.json and linked tests of tests/guard are
used. Each mutant changes one place of dr_guard, dr_judge, dr_geometry, dr_limits or dr_log in a copy, is compiled, linked
and run in fresh processes of its own, test program after test program until one fails:

  killed     a test failed         crashed    a test ended by a signal        timeout   a test ran 20 times as long
  stillborn  does not compile (not counted)   survived   no test noticed

Exit: 0 at least 97 % are killed, crashed or timed out; 1 fewer; 2 the tests fail without a mutant.
"""
import argparse
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CORE = ROOT / 'firmware' / 'core'
MODULES = ('dr_geometry', 'dr_limits', 'dr_judge', 'dr_log', 'dr_guard')
UNMUTATED = ('dr_device', 'dr_wire', 'dr_motion', 'dr_controller')
TESTS = ('geometry', 'limits', 'judge', 'moves', 'edges', 'host_rows', 'device_rows', 'people_rows')
FLAGS = ['-std=c99', '-O1', '-w', '-fsanitize=undefined', '-fno-sanitize-recover=all']

# What is replaced by what, in code (not in comments, strings or directives).
SWAPS = [
    (r'(?<![<>=!+\-*/&|^-])<(?![<=])', ['<=', '>=']), (r'(?<![<>=!-])>(?![>=])', ['>=', '<=']),
    (r'<=(?!=)', ['<', '>']), (r'(?<!>)>=', ['>', '<']), (r'==', ['!=']), (r'!=', ['==']),
    (r'&&', ['||']), (r'\|\|', ['&&']),
    (r'(?<=[\w\])]) \+ (?=[\w(])', [' - ']), (r'(?<=[\w\])]) - (?=[\w(])', [' + ']), (r'(?<=[\w\])]) \* (?=[\w(])', [' / ']),
    (r'\+\+', ['--']), (r'(?<!-)--(?!-)', ['++']), (r'\btrue\b', ['false']), (r'\bfalse\b', ['true']),
    (r'(?<=[( ])!(?=[\w(])', ['']), (r'\bif \(', ['if (!(0) || ', 'if (0 && ']),
    (r'(?<![\w.])[1-9]\d*u?(?![\w.])', ['0', '+1']),
    (r'^(\s+)(?!return|break|continue|case|default|const|static|dr_\w+ \w|u?int|bool|uint|else|for|if|switch|while)[\w>.\[\]-]+[^{}]*;$', ['DELETE']),
    (r'^\s+break;$', ['DELETE']), (r'\bcontinue;', [';']),
]


def code_of(text):
    """The text with comments, strings and directives blanked out."""
    blank = lambda found: re.sub(r'[^\n]', ' ', found.group())
    text = re.sub(r'/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', blank, text, flags=re.S)
    return re.sub(r'^[ \t]*#.*$', blank, text, flags=re.M)


def mutants_of(module):
    text = (CORE / f'{module}.c').read_text()
    code = code_of(text)
    for pattern, replacements in SWAPS:
        for found in re.finditer(pattern, code, re.M):
            line = text.count('\n', 0, found.start()) + 1
            for to in replacements:
                new = '' if to == 'DELETE' else f'({found.group()} + 1)' if to == '+1' else to
                if to == 'DELETE' and code[found.start():found.end()].count('\n') > 3:
                    continue
                yield module, line, found.start(), found.end(), text[found.start():found.end()].strip(), new


def run(command, limit=60):
    return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=limit).returncode


class Bench:
    def __init__(self, directory, unity):
        self.at, self.unity = Path(directory), unity
        self.include = [f'-I{CORE}', f'-I{unity}', f'-I{Path(__file__).parent}']
        for name in MODULES + UNMUTATED:
            self.compile(CORE / f'{name}.c', f'{name}.o')
        for name in TESTS:
            self.compile(Path(__file__).parent / f'test_{name}.c', f'test_{name}.o')
        self.compile(Path(__file__).parent / 'bench.c', 'bench.o')
        self.compile(Path(unity) / 'unity.c', 'unity.o')
        self.seconds = {}

    def compile(self, source, to):
        if run(['gcc', *FLAGS, *self.include, '-c', str(source), '-o', str(self.at / to)]):
            raise RuntimeError(f'does not compile: {source}')

    def fate(self, module=None):
        """How the tests end, with mutant.o in the place of module.o."""
        objects = [str(self.at / ('mutant.o' if name == module else f'{name}.o')) for name in MODULES + UNMUTATED]
        for name in TESTS:
            program = str(self.at / f'run_{name}')
            if run(['gcc', *FLAGS, str(self.at / f'test_{name}.o'), str(self.at / 'bench.o'), str(self.at / 'unity.o'), *objects,
                    '-o', program]):
                return 'stillborn', name
            began = time.monotonic()
            try:
                status = run([program], limit=max(5, 20 * self.seconds.get(name, 60)))
            except subprocess.TimeoutExpired:
                return 'timeout', name
            if module is None:
                self.seconds[name] = time.monotonic() - began
            if status:
                return ('crashed' if status < 0 else 'killed'), name
        return 'survived', ''


def main():
    parser = argparse.ArgumentParser(description='Mutation testing of the guard.')
    parser.add_argument('--unity', default=str(ROOT / '.deps' / 'unity'))
    parser.add_argument('--sample', type=int, default=0, help='so many mutants, drawn at random; 0: all')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--only', choices=MODULES)
    parser.add_argument('--list', action='store_true', help='tell survivors as they are found')
    arguments = parser.parse_args()
    mutants = [m for name in MODULES if arguments.only in (None, name) for m in mutants_of(name)]
    if arguments.sample:
        mutants = random.Random(arguments.seed).sample(mutants, min(arguments.sample, len(mutants)))
    directory = tempfile.mkdtemp(prefix='mutants.')
    try:
        bench = Bench(directory, arguments.unity)
        if bench.fate()[0] != 'survived':
            print('mutate: the tests fail without a mutant', file=sys.stderr)
            return 2
        fates = {}
        for module, line, start, end, old, new in mutants:
            text = (CORE / f'{module}.c').read_text()
            (Path(directory) / f'{module}.c').write_text(text[:start] + new + text[end:])
            try:
                bench.compile(Path(directory) / f'{module}.c', 'mutant.o')
                fate, _ = bench.fate(module)
            except RuntimeError:
                fate = 'stillborn'
            fates.setdefault(fate, []).append((module, line, old, new))
            if fate == 'survived':
                print(f'{module}.c:{line}: {old!r} -> {new!r} survived', flush=True)
        counted = sum(len(found) for fate, found in fates.items() if fate != 'stillborn')
        dead = counted - len(fates.get('survived', []))
        print(', '.join(f'{len(found)} {fate}' for fate, found in sorted(fates.items())) +
              f': {dead} of {counted} = {100 * dead / max(1, counted):.1f} % found')
        return 0 if dead * 100 >= 97 * counted else 1
    finally:
        shutil.rmtree(directory, ignore_errors=True)


if __name__ == '__main__':
    sys.exit(main())
