"""docs/guard.md does what it says: its configurations are right, and its ten minutes work, command by command."""
import os
import re
import subprocess
import unittest

import emu
import guard
import realtime

MANUAL = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docs", "guard.md")
with open(MANUAL, encoding="utf-8") as manual:
    WORDS = manual.read()
CONFIGS = dict(zip(("trio", "mpc"), WORDS.split("```")[1::2]))
COMMANDS = [line for line in re.findall(r"^    (.*)$", "".join(WORDS.split("```")[::2]), re.MULTILINE) if "dryrig" in line]
FIRST = COMMANDS.index("dryrig-guard check rig.conf") # before: building


class TenMinutes(realtime.TestCase):
    def follow(self, kind, directory, environment):
        """The commands in order. What runs in the background is waited for; `/tmp` is the test's own directory."""
        running = []

        def end():
            for process in reversed(running):
                process.terminate()
                process.communicate(timeout=emu.LIMIT_S)

        self.addCleanup(end)
        for command in COMMANDS[FIRST:]:
            words = command.replace("/tmp/", directory + "/")
            if kind == "mpc":
                words = words.replace("trio", "mpc").replace("MP-845", "MP-225")
            if words.endswith(" &") or "--follow" in words:
                running.append(subprocess.Popen("exec " + words.removesuffix(" &"), shell=True, cwd=directory, env=environment,
                                                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True))
                if "--follow" in words:
                    emu.wait_until(lambda: "disarmed" in running[-1].stdout.readline(), "the first news")
                else:
                    self.assertIn("ready", running[-1].stdout.readline(), words)
                if "--control" in words:
                    emu.wait_until(lambda: self.is_disarmed(directory), "the controller's proof")
                continue
            done = subprocess.run(words, shell=True, cwd=directory, env=environment, capture_output=True, text=True,
                                  timeout=emu.LIMIT_S, check=False)
            self.assertEqual(done.returncode, 0, words + "\n" + done.stdout + done.stderr)
            if " line " in words and " --speed " in words:
                self.assertRegex(done.stdout, r"x 1[01][09][09]\.\d+ +y 1000\.\d+ +z 1000\.")
            elif "replay" in words:
                self.assertRegex(done.stdout, r": 0 of \d+ answers differ")

    @staticmethod
    def is_disarmed(directory):
        with guard.Channel(directory + "/rig.sock") as channel:
            return channel.order("status")["state"] == "disarmed"

    def test_both_controllers(self):
        self.assertGreater(len(COMMANDS) - FIRST, 9)
        programs = [os.path.dirname(os.environ[name]) for name in ("DRYRIG_GUARD", "DRYRIG_EMU", "DRYRIG")]
        environment = {**os.environ, "PATH": os.pathsep.join([*programs, os.environ["PATH"]])}
        for kind, config in CONFIGS.items():
            with self.subTest(kind), emu.directory() as directory:
                with open(directory + "/rig.conf", "w", encoding="ascii") as file:
                    file.write(config)
                self.follow(kind, directory, environment)
                self.doCleanups()


if __name__ == "__main__":
    unittest.main()
