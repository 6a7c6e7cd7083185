"""The same seed, the same scenario and the same bytes of the host give the same bytes and the same trace, with faults on."""
import json
import os
import select
import subprocess
import sys
import unittest

import emu
from ctl import Rehearsal
from emu import Port, point

RUNS = 20
FAULTS = {"drop-byte": 5, "delay-byte": 5, "duplicate-byte": 5, "corrupt-byte": 5, "drop-cr": 5, "late-cr": 5, "stray-bytes": 5,
          "slow-answer": 5, "short-frame": 10, "torn-frame": 10, "lose-host-byte": 1, "ignore-stop": 20, "stall-axis y": 15,
          "slip-axis x": 15, "slow-motion 2": 15, "power-loss 300ms": 8, "power-loss-forget": 15, "usb-unplug 100ms": 5}
# What a recipient of the JSON trace learns about the host's own timing, and about the port's number.
TIMING = ("pause_us", "unread", "baud")

HOST = """
import os
fd = os.open(os.environ["DRYRIG_PORT"], os.O_RDWR | os.O_NOCTTY)
def ask(data, count):
    os.write(fd, data)
    while count > 0:
        got = os.read(fd, count)
        print(got.hex())
        count -= len(got)
def frame(code, *steps):
    return code + b"".join(n.to_bytes(4, "little") for n in steps)
ask(b"O", 1)
at = 0
for i in range(40):
    ask(b"C", 14)
    ask(frame(b"M", 1600 * (i * 7 % 11), 16 * i, 160 * (i % 3)), 1)
    ask(b"KU", 10)
"""


def told(events):
    """A JSON trace without the host's timing; the bytes of one direction are one stream, however they were cut."""
    out = []
    for event in events:
        event = {key: value for key, value in event.items() if key not in TIMING}
        last = out[-1] if out else {}
        if event["event"] == "tty":
            continue
        if event["event"] in ("from-host", "to-host") and all(last.get(key) == event[key] for key in ("event", "when_us")):
            last["bytes"] += " " + event["bytes"]
        else:
            out.append(event)
    return out


class Session(emu.InDirectory):
    def setUp(self):
        super().setUp()
        self.scenario = os.path.join(self.directory, "scenario")
        with open(self.scenario, "w", encoding="ascii") as file:
            file.writelines(f"fault {name} chance {percent}%\n" for name, percent in FAULTS.items())
            file.write("at 3s set position 2 16,16,16\nafter 20 commands power cycle 1s\non each U in 5ms knob x +3\n"
                       "on N fault wedge chance 30%\nin 7s switch rear 8 off\n")

    def session(self, clock, seed, trace="trace"):
        """A host that never waits by the machine's clock: what went over its line and when, and the trace."""
        path, record = os.path.join(self.directory, trace), os.path.join(self.directory, "record")
        with Rehearsal("mpc", "--clock", clock, "--scenario", self.scenario, "--seed", str(seed), "--trace", path,
                       "--record", record) as e:
            port = Port(e.link)

            def say(data, span="until idle 90s"):
                nonlocal port
                if self.is_gone(port):
                    port.close()
                    e.do("advance until idle")  # until it is in again
                    port = Port(e.link)
                port.send(data)
                e.do(f"advance {span}")
                if not self.is_gone(port):
                    port.receive(port.waiting())

            say(b"O")
            for i in range(30):
                say(b"C")
                if clock == "step":  # with jump the move may be over before ^C comes
                    say(b"M" + point(16000 * (i * 7 % 11), 0, 0), "40ms")
                    say(b"\x03")
                say(b"M" + point(1600 * (i * 7 % 11), 16 * i, 160 * (i % 3)))
                say(b"S\x0f" + point(320 * (i % 4), 0, 160))
                say(b"KU")
                if i % 10 == 9:
                    say(b"N")
                    e.do("power cycle" if e.controller()["state"] != "off" else "power on")
            port.close()
        with open(path, encoding="ascii") as file:
            lines = file.read().splitlines()
        with open(record, encoding="ascii") as file:
            return self.line_of(file), lines

    @staticmethod
    def line_of(record):
        """The bytes of both directions at the controllers' times, however they were cut."""
        out = []
        for line in record:
            words = line.split()
            if len(words) < 5 or words[3] not in "<>!":
                continue
            if out and out[-1][:2] == [words[0], words[3]]:
                out[-1] += words[4:]
            else:
                out.append([words[0], words[3], *words[4:]])
        return out

    @staticmethod
    def is_gone(port):
        hangup = select.poll()
        hangup.register(port.fd, 0)
        return bool(hangup.poll(0))

    def test_step(self):
        self.same("step")

    def test_jump(self):
        self.same("jump")

    def same(self, clock):
        first = self.session(clock, 45)
        struck = {name for name in FAULTS if any(f"fault {name.split()[0]}:" in line for line in first[1])}
        self.assertGreaterEqual(len(struck), len(FAULTS) - 2)  # almost all have had their chance
        for _ in range(RUNS - 1):
            again = self.session(clock, 45)
            self.same_lines(first[0], again[0])
            self.same_lines(first[1], again[1])
        self.assertTrue(first[0] != self.session(clock, 43)[0])

    def same_lines(self, one, other):
        for i, (a, b) in enumerate(zip(one, other)):
            self.assertEqual(a, b, f"line {i + 1}")
        self.assertEqual(len(one), len(other))

    def test_the_json_trace_differs_in_the_host_s_timing_only(self):
        def events():
            return told(json.loads(line) for line in self.session("step", 7, trace="trace.jsonl")[1])
        first = events()
        self.assertGreater(len(first), 300)
        for _ in range(4):
            self.same_lines(first, events())


class Run(unittest.TestCase):
    def test_a_program_at_its_own_pace(self):
        """Nothing holds the host back but the answers; no fault here takes or adds a byte, so it needs no time limit."""
        with emu.directory() as d:
            scenario, trace = os.path.join(d, "scenario"), os.path.join(d, "trace")
            with open(scenario, "w", encoding="ascii") as file:
                file.writelines(f"fault {name} chance 20%\n" for name in (
                    "delay-byte", "corrupt-byte", "late-cr 3s", "slow-answer", "stall-axis x", "slip-axis y", "slow-motion"))
            runs = []
            for _ in range(RUNS):
                done = subprocess.run([emu.PROGRAM, "run", "mpc", "--clock", "jump", "--seed", "5", "--lint=off", "--scenario", scenario,
                                       "--trace", trace, "--", sys.executable, "-c", HOST], capture_output=True, check=False,
                                      timeout=emu.LIMIT_S)
                self.assertEqual((done.returncode, done.stderr), (0, b""))
                with open(trace, encoding="ascii") as file:
                    runs.append((done.stdout.replace(b"\n", b""), file.read()))
        for run in runs:
            self.assertTrue(run == runs[0])
        self.assertIn("fault slow-motion", runs[0][1])


if __name__ == "__main__":
    emu.main()
