"""README.md is true: its programs compile and run, its commands work, its links and options exist.

    test_readme.py REPOSITORY BUILD-DIRECTORY COMPILER [FLAG...]"""
import os
import re
import subprocess
import sys
import tempfile
import time
import unittest

import realtime

ROOT, BUILD, COMPILER, *FLAGS = sys.argv[1:]
with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as file:
    README = file.read()


def blocks(language):
    found = re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    assert found, f"README.md has no {language} any more"
    return found


class Readme(realtime.TestCase):
    """Each test has emulators of its own at links of its own, in place of those that README.md names."""

    def setUp(self):
        self.directory = tempfile.TemporaryDirectory()
        self.addCleanup(self.directory.cleanup)
        for controller in ("mpc", "trio"):
            emulator = subprocess.Popen(
                [f"{BUILD}/emulator/dryrig-emu", controller, "--link", self.path(controller), "--speedup", "20"],
                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            self.addCleanup(self.stop, emulator)
            self.assertRegex(emulator.stdout.readline(), r"^ready /dev/pts/\d+\n$")

    @staticmethod
    def stop(emulator):
        emulator.terminate()
        emulator.communicate(timeout=60)

    def path(self, name):
        return os.path.join(self.directory.name, name)

    def here(self, text):
        text = text.replace("/tmp/mpc", self.path("mpc")).replace("/tmp/trio", self.path("trio")).replace("$PWD/build", BUILD)
        return re.sub(r"(?<![\w/])build/", f"{BUILD}/", text)

    def run_here(self, *command):
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=self.directory.name,
                              env={**os.environ, "PATH": f"{BUILD}/firmware/ports/posix:{os.environ['PATH']}"})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def test_commands(self):
        self.run_here("sh", "-ec", self.here("\n".join(blocks("sh"))))

    def test_guard(self):
        told = [line.split() for line in re.findall(r"^    (dryrig-guard .*)$", README, re.MULTILINE)]
        self.assertEqual(len(told), 2)
        self.run_here("sh", "-ec", blocks("sh")[-1].split("dryrig-guard")[0])  # rig.conf
        run, order = ([self.here(word).replace("/dev/ttyUSB0", self.path("mpc")).replace("/tmp/rig", self.path("rig"))
                       for word in words[1:]] for words in told)
        guard = subprocess.Popen([f"{BUILD}/firmware/ports/posix/dryrig-guard", *run], cwd=self.directory.name,
                                 stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(self.stop, guard)
        self.assertRegex(guard.stdout.readline(), r"^ready /dev/pts/\d+\n$")
        self.run_here(f"{BUILD}/firmware/ports/posix/dryrig-guard", "ctl", self.path("rig.sock"), "status")
        for _ in range(1200):  # it proves first who the controller is
            if '"needs":[{"need":"key"' in self.run_here(f"{BUILD}/firmware/ports/posix/dryrig-guard", "ctl", "--json",
                                                         self.path("rig.sock"), "status"):
                break
            time.sleep(0.05)
        self.run_here(f"{BUILD}/firmware/ports/posix/dryrig-guard", *order)
        out = self.run_here(f"{BUILD}/host/dryrig", "--port", self.path("rig"), "--controller", "mpc", "--stage", "MP-225", "line",
                            "100", "200", "300", "--speed", "15")
        self.assertEqual(out, "x 100.000  y 200.000  z 300.000 um  drive 1\n")

    def test_python(self):
        for program in blocks("python"):
            self.assertEqual(self.run_here(sys.executable, "-c", self.here(program)), "drive 1 is at 1000.0 500.0 300.0 um\n")

    def test_c(self):
        libraries = subprocess.run(["pkg-config", "--libs", "libserialport"], capture_output=True, text=True, check=True)
        for program in blocks("c"):
            with open(self.path("example.c"), "w", encoding="utf-8") as source:
                source.write(self.here(program))
            self.run_here(COMPILER, "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", *FLAGS, f"-I{ROOT}/host/include",
                          self.path("example.c"), f"{BUILD}/host/libdryrig.a", *libraries.stdout.split(), "-o", self.path("example"))
            self.assertEqual(self.run_here(self.path("example")), "at 1000.000 2000.000 500.000 um\n")


class Words(unittest.TestCase):
    def test_links_lead_somewhere(self):
        for target in re.findall(r"\]\(([^)#:]+)\)", README):
            self.assertTrue(os.path.exists(os.path.join(ROOT, target)), target)

    def test_options_exist(self):
        programs = [f"{BUILD}/emulator/dryrig-emu", f"{BUILD}/host/dryrig"]
        programs += [f"{BUILD}/emulator/dryrig-panel", f"{BUILD}/firmware/ports/posix/dryrig-guard"]
        known = "".join(subprocess.run([p, "--help"], capture_output=True, text=True, check=True).stdout for p in programs)
        known += subprocess.run([programs[-1], "explain", "--help"], capture_output=True, text=True, check=True).stdout
        others = {"--build", "--install", "--cflags", "--libs"}  # of CMake and pkg-config
        for option in set(re.findall(r"(?<![\w-])--[a-z]+", README)) - others:
            self.assertRegex(known, rf"{option}\b")

    def test_emulators_start_as_told(self):
        for line in re.findall(r"^    (dryrig-emu .*)$", README, re.MULTILINE):
            emulator = subprocess.Popen([f"{BUILD}/emulator/dryrig-emu", *line.split()[1:]], stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL, text=True)
            try:
                self.assertTrue(emulator.stdout.readline().startswith("ready"), line)
            finally:
                emulator.kill()
                emulator.communicate()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
