"""docs/ci.md is true: every recipe in it is carried out, but for MATLAB's, and what servers alone can do.

The programs that it speaks of: my-tests, which does as $TESTS says; the tests in docs/ci-example."""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import realtime

ROOT = os.environ["DRYRIG_ROOT"]
EXAMPLE = os.path.join(ROOT, "docs", "ci-example")
LIMIT_S = 300
with open(os.path.join(ROOT, "docs", "ci.md"), encoding="utf-8") as text:
    PAGE = text.read()

MY_TESTS = f"""#!/bin/sh
case $TESTS in
right) sleep 0.01; exec 3<>"$DRYRIG_PORT"; printf '\\003' >&3; head -c 1 <&3 >/dev/null ;;
hasty) exec 3<>"$DRYRIG_PORT"; printf '\\101\\055\\101\\055' >&3; head -c 2 <&3 >/dev/null ;;
stopping)
    sleep 0.01; exec 3<>"$DRYRIG_PORT"
    printf 'M\\000\\175\\000\\000\\000\\175\\000\\000\\000\\175\\000\\000' >&3
    dryrig-emu ctl "$DRYRIG_CONTROL" advance 250ms
    printf '\\003' >&3; head -c 1 <&3 >/dev/null; dryrig-emu ctl "$DRYRIG_CONTROL" state ;;
*) exit "$TESTS" ;;
esac
"""
TESTS_OF_PYTEST = """
import serial, stage_fixed, time

def test_right(controller_port):
    with serial.Serial(controller_port, 128000, timeout=10) as port:
        assert stage_fixed.approach(stage_fixed.Stage(port)) == ((0, 0, 0), (1000, 1000, 500))

def test_hasty(controller_port):
    with serial.Serial(controller_port, 128000, timeout=10) as port:
        port.write(b"KK")
        assert len(port.read(8)) == 8
"""


def blocks(language, under=""):
    """Those of a section, or of the whole page."""
    part = PAGE if under == "" else PAGE.split(f"\n## {under}\n")[1].split("\n## ")[0]
    found = re.findall(rf"^```{language}\n(.*?)^```$", part, re.MULTILINE | re.DOTALL)
    assert found, f"docs/ci.md has no {language} in '{under}' any more"
    return found


class Recipes(realtime.TestCase):
    def setUp(self):
        context = tempfile.TemporaryDirectory()
        self.addCleanup(context.cleanup)
        self.directory = context.name
        shutil.copytree(EXAMPLE, os.path.join(self.directory, "docs", "ci-example"), ignore=shutil.ignore_patterns("__pycache__"))
        with open(os.path.join(self.directory, "my-tests"), "w", encoding="ascii") as file:
            file.write(MY_TESTS)
        os.chmod(file.name, 0o755)
        bin_ = os.path.join(self.directory, "bin")
        os.mkdir(bin_)
        os.symlink(os.environ["DRYRIG_EMU"], os.path.join(bin_, "dryrig-emu"))
        os.symlink(sys.executable, os.path.join(bin_, "python3"))
        self.environment = dict(os.environ, PATH=f"{bin_}:/usr/bin:/bin", PYTHONPATH=EXAMPLE, PYTHONDONTWRITEBYTECODE="1")
        self.environment.pop("DRYRIG_EMU")  # it is on the PATH

    def shell(self, script, where="", **more):
        done = subprocess.run(["sh", "-c", script], cwd=os.path.join(self.directory, where), capture_output=True, text=True,
                              timeout=LIMIT_S, check=False, env={**self.environment, **more})
        return done.returncode, done.stdout, done.stderr

    def test_one_line_in_front(self):
        line = PAGE.split("```sh\n")[1].split("```")[0]
        self.assertIn(" -- ./my-tests ", line)
        self.assertEqual((5, "", ""), self.shell(line, TESTS="5"))
        status, _, err = self.shell(line.replace("mpc --device MP-225", "trio"), TESTS="hasty")
        self.assertEqual(3, status)
        self.assertIn("early-command", err)

    def test_a_move_is_stopped(self):
        line = blocks("sh", "Programs that stop moves")[0]
        status, out, err = self.shell(line, TESTS="stopping")
        self.assertEqual((0, ""), (status, err))
        state = json.loads(out.splitlines()[1])
        self.assertEqual(250000, state["now_us"])
        for steps in state["controllers"][0]["devices"][0]["position_steps"]:
            self.assertTrue(0 < steps < 32000, steps)

    def test_what_it_finds(self):
        for line in blocks("sh", "What it finds that a fake port does not"):
            status, _, err = self.shell(line)
            self.assertEqual(3, status)
            for rule in re.findall(r"`([a-z]+(?:-[a-z]+)+)` \(", PAGE):
                self.assertIn(rule, err)
            self.assertEqual(0, self.shell(line.replace("stage.py", "stage_fixed.py"))[0])

    def test_plain_shell(self):
        for script in blocks("sh", "Plain shell"):
            for tests, said in (("right", "passed\n"), ("hasty", "passed, but broke the protocol's rules\n"), ("5", "failed: 5\n")):
                self.assertEqual(said, self.shell(script, TESTS=tests)[1])

    def test_what_servers_do(self):
        """The line that runs the tests is the same on each; what comes before it is what 'Getting it' says."""
        getting = [line for block in blocks("sh", "Getting it") for line in block.splitlines()]
        for server in ("GitHub Actions", "GitLab"):
            page = "".join(blocks("yaml", server))
            for line in getting:
                self.assertIn(line, page)
            tests = re.findall(r"dryrig-emu run .*", page)
            self.assertEqual(1, len(tests))
            status, _, err = self.shell(tests[0], where="docs/ci-example")
            self.assertEqual(0, status, err)
            self.assertIn("Ran 2 tests", err)
            self.assertTrue(os.path.exists(os.path.join(self.directory, "docs", "ci-example", "lint.xml")))

    def test_pytest(self):
        for fixture in blocks("python", "pytest"):
            with open(os.path.join(self.directory, "conftest.py"), "w", encoding="utf-8") as file:
                file.write(fixture)
        with open(os.path.join(self.directory, "test_mine.py"), "w", encoding="utf-8") as file:
            file.write(TESTS_OF_PYTEST)
        status, out, err = self.shell("python3 -m pytest -q -p no:cacheprovider test_mine.py")
        self.assertEqual(1, status, out + err)
        self.assertIn("2 passed, 1 error", out)  # the teardown of the hasty one
        self.assertRegex(out, r"ERROR test_mine\.py::test_hasty")
        for line in re.findall(r"`(dryrig-emu run [^`]* -- pytest)`", PAGE):
            line = line.replace("-- pytest", "-- python3 -m pytest -q -p no:cacheprovider docs/ci-example/test_stage.py")
            self.assertEqual(0, self.shell(line)[0], line)

    def test_options_and_rules_exist(self):
        known = self.shell("dryrig-emu --help")[1]
        for option in re.findall(r"`(--[a-z-]+)", PAGE):
            self.assertIn(option, known)


class Sources(unittest.TestCase):
    """Getting it: what is built is installed, and works from there. The packages are those of scripts/setup."""

    def test_getting_it(self):
        with tempfile.TemporaryDirectory() as directory:
            os.symlink(ROOT, os.path.join(directory, "dryrig"))
            for block in blocks("sh", "Getting it"):
                packages, *commands = block.splitlines()
                with open(os.path.join(ROOT, "scripts", "setup"), encoding="utf-8") as file:
                    setup = file.read()
                for package in packages.removeprefix("apt-get install -y ").split():
                    self.assertRegex(setup, rf"[( ]{re.escape(package)}[ )]")
                script = "\n".join(commands).replace("dryrig/build", "build")  # not within the sources
                subprocess.run(["nice", "sh", "-ec", script], cwd=directory, check=True, capture_output=True, timeout=1500,
                               env=dict(os.environ, DESTDIR=os.path.join(directory, "installed")))
            installed = os.path.join(directory, "installed", "usr", "local", "bin", "dryrig-emu")
            self.assertEqual(0, subprocess.run([installed, "run", "trio", "--", "true"], check=False, timeout=LIMIT_S).returncode)


if __name__ == "__main__":
    unittest.main()
