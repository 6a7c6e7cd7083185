"""PROTOCOL.md, "Hand controls", and the tests of the hands name each other: every test that the section names exists and is
run, and every test is named there.

    test_protocol_md.py PROTOCOL.md TEST.c...
"""
import re
import sys
from pathlib import Path


def main():
    page, *sources = (Path(argument).read_text() for argument in sys.argv[1:])
    section = page.split("\n## Hand controls\n")[1].split("\n## ")[0]
    named = set(re.findall(r"`([a-z]+(?:_[a-z0-9]+){2,})`", section))
    run = {name for source in sources for name in re.findall(r"\bRUN\((\w+)\);", source)}
    for name in sorted(named - run):
        print(f"PROTOCOL.md names {name}, and no test of that name is run")
    for name in sorted(run - named):
        print(f"{name} is run, and PROTOCOL.md does not name it")
    return 1 if named != run or not run else 0


if __name__ == "__main__":
    sys.exit(main())
