"""Checks the rules of firmware/core: integers only; no heap, clock, stdio, operating system, per-target code, recursion,
unbounded loop, call through a pointer, or memory of its own; modules depend one way.

    core_rules.py DIRECTORY [--cc GCC]

DIRECTORY holds the modules (*.c, *.h) and the CMakeLists.txt whose dr_core_module(NAME USES... [ROOMS FILES...]) say which
module may use which, and which rooms a module has: each may use the rooms before it. NAME_rooms.h is the rooms' own. Prints one line a violation, file:line: rule: what, and exits with 1 if there is one, with 2 if it could
not check. Words are looked for everywhere, comments included, so that a plain grep says the same.
"""
import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

FORBIDDEN_WORDS = """float double malloc calloc realloc free alloca printf fprintf sprintf snprintf puts scanf stdio stdlib errno
    unistd goto setjmp longjmp""".split()
ALLOWED_HEADERS = {"stdbool.h", "stddef.h", "stdint.h", "string.h"}
ALLOWED_LIBRARY = {"memcpy", "memset", "memcmp", "memmove"}
# Helpers of the compiler for arithmetic that the machine lacks, and the table of position-independent code.
COMPILERS_OWN = re.compile(r"^(__u?(div|mod|divmod)[sdt]i[34]|__(mul|ashl|ashr|lshr|clz|ctz)[sdt]i[23]|__aeabi_\w+"
                           r"|_GLOBAL_OFFSET_TABLE_)$")
BOUND_STATED = re.compile(r"/\*.*\b(at most|bound|bounded)\b.*\*/")


class CannotCheck(Exception):
    pass


def code_only(text):
    """The text with comments, strings and characters blanked out, line by line as before."""
    token = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', re.S)
    return token.sub(lambda found: re.sub(r"[^\n]", " ", found.group()), text)


def line_of(text, offset):
    return text.count("\n", 0, offset) + 1


def closing(code, opening):
    """Where the bracket that opens at `opening` closes."""
    depth = 0
    for at in range(opening, len(code)):
        depth += {"(": 1, ")": -1}.get(code[at], 0)
        if depth == 0:
            return at
    raise CannotCheck("unbalanced brackets")


def words(text, code):
    # A word is a run of letters: float32 and my_float are caught, floating is not.
    for word in FORBIDDEN_WORDS:
        for found in re.finditer(rf"(?<![a-z]){word}(?![a-z])", text, re.I):
            yield found.start(), "word", f"'{found.group()}' does not belong into the core"
    for found in re.finditer(r"(?<![\w.])(\d+\.\d*|\.\d+|\d+[eE][+-]?\d+)", code):
        yield found.start(), "number", f"{found.group()} is no integer"


def directives(text, code):
    for found in re.finditer(r"^[ \t]*#[ \t]*(\w+)[ \t]*(.*)$", code, re.M):
        name, rest = found.group(1), found.group(2).strip()
        if name in ("if", "elif") or name in ("ifdef", "ifndef") and not re.match(r"(DR_\w+|__cplusplus)$", rest):
            yield found.start(), "target", f"#{name} {rest}: the core is the same for every target (allowed: DR_*, __cplusplus)"
        elif name not in ("define", "undef", "include", "ifdef", "ifndef", "else", "endif"):
            yield found.start(), "target", f"#{name}: not in the core"


def loops(text, code):
    lines = text.split("\n")
    for found in re.finditer(r"\b(while|for)\s*\(", code):
        inside = code[found.end():closing(code, found.end() - 1)]
        stated = BOUND_STATED.search(lines[line_of(code, found.start()) - 1])
        if found.group(1) == "while":
            endless = re.fullmatch(r"\s*(1|true)\s*", inside)
            bounded = stated
        else:
            condition, step = (inside.split(";") + ["", ""])[1:3]
            endless = re.fullmatch(r"\s*(1|true)?\s*", condition)
            bounded = stated or re.search(r"[<>]|!=", condition) and re.search(r"\+\+|--|[-+*/]=|<<=|>>=", step)
        if endless:
            yield found.start(), "loop", "endless"
        elif not bounded:
            yield found.start(), "loop", "no bound in sight: state it on this line, /* at most ... */"


def includes(path, text, own, may_include):
    for found in re.finditer(r"^[ \t]*#[ \t]*include[ \t]+(\S+)", text, re.M):
        name = found.group(1).strip('<>"')
        if found.group(1) == "DR_ROM_HEADER" or name in ALLOWED_HEADERS:
            continue
        if name not in own:
            yield found.start(), "include", f"{name}: only {', '.join(sorted(ALLOWED_HEADERS))} and the core's own"
        elif Path(name).stem != path.stem and Path(name).stem not in may_include.get(path.stem, set()):
            yield found.start(), "layer", f"{path.stem} may not use {Path(name).stem} (see CMakeLists.txt)"


def layers(directory):
    """Which files each file may call and which headers it may include, itself not counted; as the build has it."""
    uses, rooms = {}, {}
    lists = directory / "CMakeLists.txt"
    for name, rest in re.findall(r"^dr_core_module\((\w+)([^)]*)\)", lists.read_text(), re.M):
        used, _, inside = rest.partition("ROOMS")
        uses[name], rooms[name] = set(used.split()), inside.split()
    if not uses:
        raise CannotCheck(f"{lists}: no dr_core_module(NAME USES...)")
    for _ in uses:
        for name in uses:
            uses[name] = uses[name].union(*(uses.get(other, set()) for other in uses[name]))
    may_call, may_include = dict(uses), dict(uses)
    for name in uses:
        header = f"{name}_rooms"
        if rooms[name]:
            may_call[name] = uses[name] | set(rooms[name])
            may_include[name] = uses[name] | {header}
            may_include[header] = uses[name] | {name}
        for at, room in enumerate(rooms[name]):
            may_call[room] = uses[name] | set(rooms[name][:at])
            may_include[room] = uses[name] | {name, header}
    return may_call, may_include


def run(*command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        raise CannotCheck(f"{' '.join(map(str, command))}\n{done.stderr}")
    return done.stdout


def objects(sources, directory, cc, may_call):
    """What only the compiler knows: calls, symbols."""
    calls, defined, undefined = {}, {}, {}
    with tempfile.TemporaryDirectory() as temporary:
        for source in sources:
            made = Path(temporary, source.stem + ".o")
            # -O0: every call is still there. General registers only: a compiler error wherever floating point is needed.
            registers = ["-mgeneral-regs-only"] if run(cc, "-dumpmachine").startswith(("x86_64", "aarch64")) else []
            run(cc, "-std=c99", "-O0", "-fcallgraph-info", *registers, "-I", directory, "-c", source, "-o", made)
            graph = made.with_suffix(".ci").read_text()
            for caller, called in re.findall(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', graph):
                calls.setdefault(caller, set()).add(called)
                if called == "__indirect_call":
                    yield source, 0, "call", f"{caller.split(':')[-1]} calls through a pointer"
            for line in run("nm", "-P", made).splitlines():
                name, kind = line.split()[:2]
                if kind == "U":
                    undefined.setdefault(source, set()).add(name)
                elif kind in "BbDdCGgSs":
                    yield source, 0, "memory", f"{name} is a variable of the module's own: the caller owns all memory"
                elif kind.isupper():
                    defined[name] = source
                    if not name.startswith("dr_"):
                        yield source, 0, "name", f"{name}: a public name begins with dr_"
    for source, names in undefined.items():
        for name in sorted(names - ALLOWED_LIBRARY):
            if name in defined:
                if defined[name].stem not in may_call.get(source.stem, set()):
                    yield source, 0, "layer", f"{source.stem} may not call {name} of {defined[name].stem} (see CMakeLists.txt)"
            elif not COMPILERS_OWN.match(name):
                yield source, 0, "symbol", f"{name} is not the core's (allowed: {', '.join(sorted(ALLOWED_LIBRARY))})"
    for path in cycles(calls):
        names = [name.split(":")[-1] for name in path]
        where = next((source for source in sources if path[0].startswith(str(source) + ":")), defined.get(path[0], directory))
        yield where, 0, "recursion", " calls ".join(names)


def cycles(calls):
    """The circles in who calls whom, each once."""
    done = set()

    def visit(name, path):
        if name in path:
            yield path[path.index(name):] + [name]
        elif name not in done:
            for called in sorted(calls.get(name, ())):
                yield from visit(called, path + [name])
            done.add(name)

    for name in sorted(calls):
        yield from visit(name, [])


def violations(directory, cc):
    files = sorted(directory.glob("*.[ch]"))
    sources = [path for path in files if path.suffix == ".c"]
    if not sources:
        raise CannotCheck(f"{directory}: no *.c")
    may_call, may_include = layers(directory)
    own = {path.name for path in files}
    for path in files:
        text = path.read_text()
        code = code_only(text)
        if path.stem not in may_include:
            yield path, 1, "layer", "not a dr_core_module() of CMakeLists.txt"
        for found in (words(text, code), directives(text, code), loops(text, code), includes(path, text, own, may_include)):
            for offset, rule, what in found:
                yield path, line_of(text, offset), rule, what
    yield from objects(sources, directory, cc, may_call)


def main():
    parser = argparse.ArgumentParser(description="Checks the rules of firmware/core.")
    parser.add_argument("directory", type=Path)
    parser.add_argument("--cc", default="gcc", help="a gcc (it tells who calls whom)")
    arguments = parser.parse_args()
    count = 0
    try:
        for path, line, rule, what in violations(arguments.directory, arguments.cc):
            print(f"{path}:{line}: {rule}: {what}" if line else f"{path}: {rule}: {what}")
            count += 1
    except (CannotCheck, OSError) as problem:
        print(f"core_rules: cannot check: {problem}", file=sys.stderr)
        return 2
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
