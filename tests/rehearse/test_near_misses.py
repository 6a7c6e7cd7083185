"""Every fault that the program lists strikes when it is asked for, and does not when it nearly is: on another command, after more
commands than come, before its time, behind its time, taken back. What does not strike leaves every byte at its microsecond."""
import json
import unittest

import emu
from ctl import Rehearsal
from emu import Port, point

ARGUMENTS = {"stall-axis": " x", "slip-axis": " x"}
STRANGERS = ("home", "mode", "calibrate")  # commands that the exercise does not have
# What can be asked for one command only is refused for these; what no command is, cannot be asked for one at all.
ONE_COMMAND_ONLY = {"short-frame", "torn-frame", "ignore-stop"}
NO_COMMAND = {"lose-host-byte"}


# A question, a move, a line with streamed positions that is stopped: something of everything that can be struck.
EXERCISE = ((b"K", "10ms"), (b"M" + point(3200, 3200, 3200), "3s"), (b"C", "10ms"), (b"O", "10ms"), (b"S\x03", "30ms"),
            (point(16000, 1600, 800), "100ms"), (b"\x03", "50ms"), (b"C", "10ms"))
COMMANDS = 7


def outcome(*before):
    """What the host gets, when, and how the controller stands then; and what has struck."""
    events = []
    with Rehearsal("mpc", "--clock", "step", "--pace", "on", "--seed", "5") as e, Port(e.path) as port:
        for line in ("advance 10ms", *before, "subscribe"):
            e.do(line)
        for request, time in EXERCISE:
            try:
                port.send(request)
            except OSError:
                pass  # the plug is out
            answer = e.say(f"advance {time}")
            while "event" in answer:
                events.append(answer)
                answer = json.loads(e.lines.readline())
        controller = e.controller()
    seen = [(event["event"], event["when_us"], event["bytes"]) for event in events if event["event"] in ("to-host", "lost")]
    struck = [event["text"] for event in events if event["event"] == "fault"]
    return (seen, controller["state"], controller["devices"], controller["port"] is None), struck


class EveryFault(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.usual, struck = outcome()
        assert not struck
        with Rehearsal("mpc") as e:
            cls.names = [entry["fault"] for entry in e.do("faults")["faults"]]
            cls.refusals = {}
            for name in cls.names:
                fault = name + ARGUMENTS.get(name, "")
                cls.refusals[name] = {word for word in STRANGERS if not e.say(f"fault {fault} on {word}")["ok"]}
                e.do("fault off")

    def each(self, check):
        for name in self.names:
            with self.subTest(name):
                check(name, "fault " + name + ARGUMENTS.get(name, ""))

    def misses(self, *before):
        self.assertEqual((self.usual, []), outcome(*before))

    def test_strikes(self):
        def check(name, fault):
            got, struck = outcome(fault)
            self.assertNotEqual(got, self.usual)
            self.assertEqual(1, len(struck))
            self.assertTrue(struck[0].startswith(f"fault {name}: "), struck)
        self.each(check)

    def test_not_on_another_command(self):
        def check(name, fault):
            if name in ONE_COMMAND_ONLY | NO_COMMAND:
                self.assertEqual(set(STRANGERS), self.refusals[name])
            else:
                self.misses(f"{fault} on {[word for word in STRANGERS if word not in self.refusals[name]][0]}")
        self.each(check)

    def test_not_after_more_commands_than_come(self):
        self.each(lambda _, fault: self.misses(f"after {COMMANDS + 1} commands {fault}"))

    def test_not_before_its_time(self):
        self.each(lambda _, fault: self.misses(f"{fault} from 1h"))

    def test_not_behind_its_time(self):
        self.each(lambda _, fault: self.misses(f"{fault} until 5ms"))

    def test_not_when_it_is_taken_back(self):
        self.each(lambda name, fault: self.misses(fault, f"fault {name} off"))

    def test_not_by_a_chance_of_one_in_a_million(self):
        self.each(lambda _, fault: self.misses(f"{fault} chance 0.000001"))


if __name__ == "__main__":
    emu.main()
