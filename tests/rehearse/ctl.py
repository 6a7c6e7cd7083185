"""What the tests of the control channel share: an emulator with a socket, and talking to it."""
import json
import os
import socket
import subprocess

import emu


class Rehearsal(emu.Emulator):
    """An emulator with a control channel, in a directory of its own."""

    def __init__(self, *args, **popen):
        self.context = emu.directory()
        self.directory = self.context.__enter__()
        self.socket_path = os.path.join(self.directory, "control")
        self.link = os.path.join(self.directory, "link")
        super().__init__(*args, "--control", self.socket_path, "--link", self.link, **popen)
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(emu.LIMIT_S)
        self.socket.connect(self.socket_path)
        self.lines = self.socket.makefile("rw", encoding="utf-8")

    def __exit__(self, *args):
        self.lines.close()
        self.socket.close()
        try:
            super().__exit__(*args)
            if args[0] is None and os.listdir(self.directory):
                raise AssertionError(f"left behind: {os.listdir(self.directory)}")
        finally:
            self.context.__exit__(None, None, None)

    def say(self, line):
        self.lines.write(line + "\n")
        self.lines.flush()
        return json.loads(self.lines.readline())

    def do(self, line):
        answer = self.say(line)
        if not answer["ok"]:
            raise AssertionError(f"{line}: {answer}")
        return answer

    def refuses(self, line):
        answer = self.say(line)
        if answer["ok"]:
            raise AssertionError(f"{line} was not refused: {answer}")
        return answer["why"]

    def controller(self):
        return self.do("state")["controllers"][0]

    def position(self, port=1):
        return self.controller()["devices"][port - 1]["position_steps"]


def ctl(path, *words):
    done = subprocess.run([emu.PROGRAM, "ctl", path, *words], capture_output=True, timeout=emu.LIMIT_S, check=False)
    return done.returncode, done.stdout.decode(), done.stderr.decode()
