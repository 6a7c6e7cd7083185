"""The control channel: every verb, what it refuses and what it says then; time that moves when it is told to."""
import json
import os
import re
import select
import socket
import stat
import subprocess
import sys
import termios
import unittest

import emu
from ctl import Rehearsal, ctl
from emu import Port, point

CR = b"\r"
MANUAL = os.path.join(os.path.dirname(__file__), "..", "..", "emulator", "dryrig-control.7")


class Step(unittest.TestCase):
    def test_a_move_is_stopped_at_exactly_250_ms(self):
        # An MP-225 runs at 3,000 um/s and has 16 steps a um: 400,000 steps take 8,333,334 us, rounded up.
        gone = 400000 * 250000 // 8333334
        for _ in range(20):
            with Rehearsal("mpc", "--clock", "step") as e, Port(e.path) as port:
                port.send(b"M" + point(400000, 200, 0))
                self.assertEqual(e.do("advance 250ms")["now_us"], 250000)
                self.assertEqual(e.position(), [gone, 200, 0])
                port.send(b"\x03")
                self.assertEqual(port.receive(1), CR)
                e.do("advance 10s")
                self.assertEqual(port.ask(b"C", 14), b"\x01" + point(gone, 200, 0) + CR)

    def test_every_microsecond_counts(self):
        with Rehearsal("mpc", "--clock", "step") as e, Port(e.path) as port:
            port.send(b"M" + point(48, 0, 0))  # 1,000 us
            for us in (1, 20, 21, 41, 500, 999):  # floor(48 * t / 1000)
                e.do(f"advance {us - e.do('state')['now_us']}us")
                self.assertEqual(e.position()[0], 48 * us // 1000)
            self.assertEqual(port.waiting(), 0)
            e.do("advance 1us")
            self.assertEqual(port.receive(1), CR)

    def test_until_idle_and_its_limit(self):
        with Rehearsal("mpc", "--clock", "step") as e, Port(e.path) as port:
            port.send(b"M" + point(400000, 0, 0))  # 8,333,334 us
            self.assertEqual(e.do("advance until idle 1s"), {"ok": True, "now_us": 0, "idle": False})
            self.assertEqual(e.do("advance until idle"), {"ok": True, "now_us": 8333334, "idle": True})
            self.assertEqual(port.receive(1), CR)

    def test_bytes_that_wait_are_taken_in_first(self):
        with Rehearsal("mpc", "--clock", "step") as e, Port(e.path) as port:
            for target in (100, 0) * 200:
                port.send(b"M" + point(target, 0, 0))
                self.assertTrue(e.do("advance until idle")["idle"])
                self.assertEqual(port.receive(1), CR)

    def test_paced(self):
        with Rehearsal("mpc", "--clock", "step", "--pace", "on") as e, Port(e.path) as port:
            port.send(b"K")
            e.do("advance 391us")  # the command is through at 79, four bytes of 78.125 us after that at 392
            self.assertEqual(port.receive(3), b"\x01\x21\x03")
            self.assertEqual(port.waiting(), 0)
            e.do("advance 1us")
            self.assertEqual(port.receive(1), CR)

    def test_the_same_commands_give_the_same_events(self):
        runs = []
        for _ in range(3):
            with Rehearsal("trio", "--clock", "step") as e, Port(e.path) as port:
                e.do("at 300ms power off")
                e.do("in 600ms power on")
                e.do("subscribe")
                port.send(b"H" + point(30000, 2, 3))
                e.do_lines = []
                e.lines.write("advance 5s\nquit\n")
                e.lines.flush()
                events = [json.loads(line) for line in e.lines]
            runs.append([event for event in events if event.get("event") in ("note", "event", "to-host")])
            self.assertGreater(len(runs[0]), 5)
        self.assertEqual(runs[0], runs[1])
        self.assertEqual(runs[0], runs[2])

    def test_advance_is_refused_where_it_makes_no_sense(self):
        with Rehearsal("mpc") as e:
            self.assertIn("--clock", e.refuses("advance 1s"))
        with Rehearsal("mpc", "--clock", "step", "--wait-client") as e:
            self.assertIn("--wait-client", e.refuses("advance 1s"))
            with Port(e.path):
                self.assertEqual(e.do("advance 1s")["now_us"], 1000000)
        with Rehearsal("mpc", "--clock", "step") as e:
            for line, words in (("advance", "250ms"), ("advance 5", "unit"), ("advance until", "idle"),
                                ("advance until noon", "idle"), ("advance 1s 2s", "too many"), ("advance 9999h", "1000h")):
                self.assertIn(words, e.refuses(line), line)


class Hands(unittest.TestCase):
    def test_power(self):
        with Rehearsal("mpc", "--clock", "step") as e, Port(e.path) as port:
            port.send(b"M" + point(48000, 0, 0))
            e.do("advance 500ms")
            e.do("power off")
            self.assertEqual(e.controller()["state"], "off")
            self.assertIn("off", e.refuses("power off"))
            port.send(b"C")
            e.do("advance 2s")
            self.assertEqual(port.waiting(), 0)
            e.do("power on")
            self.assertEqual(port.ask(b"C", 14), b"\x01" + point(24000, 0, 0) + CR)
            e.do("power cycle 3s")
            e.do("advance 2999999us")
            self.assertEqual(e.controller()["state"], "off")
            e.do("advance 1us")
            self.assertEqual(e.controller()["state"], "rest")
            e.do("power cycle")
            self.assertEqual(e.controller()["state"], "rest")
            self.assertIn("cycle", e.refuses("power up"))

    def test_power_off_with_and_without_the_positions(self):
        with Rehearsal("mpc", "--clock", "step") as e, Port(e.path) as port:
            for how, told, trusted in (("", 24000, "calibrated"), (" forget", 0, "uncalibrated, power-cycled")):
                e.do("set position 0,0,0")
                port.send(b"M" + point(48000, 0, 0))  # a second
                e.do("advance 500ms")
                e.do(f"power cycle 2s{how}")
                e.do("advance 2s")
                self.assertEqual(port.ask(b"C", 14), b"\x01" + point(told, 0, 0) + CR)
                device = e.controller()["devices"][0]
                self.assertEqual((device["tip_steps"], device["calibration"]), ([24000, 0, 0], trusted))
            port.send(b"N")  # finds the ends
            e.do("advance until idle")
            self.assertEqual(port.receive(1), CR)
            device = e.controller()["devices"][0]
            self.assertEqual((device["tip_steps"], device["calibration"]), ([0, 0, 0], "calibrated"))
            e.do("power off forget")
            for line, words in (("power cycle forget 2s", "too many"), ("power on forget", "too many"), ("power cycle soon", "unit")):
                self.assertIn(words, e.refuses(line), line)

    def test_devices(self):
        with Rehearsal("mpc", "--device", "MP-285", "--device", "MP-845") as e, Port(e.path) as port:
            e.do("device 2 unplug")
            self.assertEqual(port.ask(b"U", 6), b"\x01\x01\x00\x00\x00" + CR)
            self.assertIn("nothing", e.refuses("device 2 unplug"))
            e.do("device 2 plug")
            self.assertEqual(e.controller()["devices"][1]["model"], "MP-845")
            e.do("device 4 plug MP-265")
            self.assertEqual(port.ask(b"U", 6), b"\x03\x01\x01\x00\x01" + CR)
            for line, words in (("device 5 unplug", "1 to 4"), ("device", "1 to 4"), ("device 3 plug", "which model"),
                                ("device 3 plug MP-999", "MP-225"), ("device 3 plug MOM", "3.13"), ("device 1 kick", "unplug")):
                self.assertIn(words, e.refuses(line), line)

    def test_usb(self):
        with Rehearsal("mpc", "--clock", "step") as e:
            port = Port(e.link)
            self.assertEqual(port.ask(b"K", 4), emu.ACTIVE[1])
            e.do("usb unplug 2s")
            self.assertFalse(os.path.lexists(e.link))
            try:
                self.assertEqual(os.read(port.fd, 1), b"")
            except OSError:
                pass
            port.close()
            self.assertIsNone(e.controller()["port"])
            e.do("advance 2s")
            with Port(e.link) as port:
                self.assertEqual(port.ask(b"K", 4), emu.ACTIVE[1])
            e.do("usb unplug")
            e.do("usb plug")
            with Port(e.link) as port:
                self.assertEqual(port.ask(b"K", 4), emu.ACTIVE[1])

    def test_a_fault_takes_the_cable_out_when_a_command_has_arrived(self):
        for clock in (["--clock", "step"], ["--clock", "step", "--pace", "on"], ["--clock", "jump"], []):
            with Rehearsal("mpc", *clock) as e:
                e.do("fault usb-unplug 1s on M")
                with Port(e.link) as port:
                    port.send(b"K")
                    e.do("advance 1s" if "step" in clock else "state")
                    self.assertEqual(port.receive(4), emu.ACTIVE[1])
                    port.send(b"M" + point(1600, 0, 0))
                    if "step" in clock:
                        e.do("advance 900ms")
                        self.assertFalse(os.path.lexists(e.link))
                        e.do("advance 2s")
                    hung_up = select.poll()
                    hung_up.register(port.fd, 0)
                    self.assertEqual([event & select.POLLHUP for _, event in hung_up.poll(emu.LIMIT_S * 1000)], [select.POLLHUP])
                    try:
                        self.assertEqual(os.read(port.fd, 1), b"")
                    except OSError:
                        pass
                emu.wait_until(lambda: os.path.lexists(e.link), "the link is there again")
                with Port(e.link) as port:  # the move was made, its CR is gone with the cable
                    port.send(b"C")
                    if "step" in clock:
                        e.do("advance 1s")
                    self.assertEqual(port.receive(14), b"\x01" + point(1600, 0, 0) + CR)

    def test_a_fault_takes_the_power_in_a_move(self):
        with Rehearsal("mpc", "--clock", "step") as e, Port(e.path) as port:
            e.do("fault power-loss 2s on M")
            port.send(b"M" + point(48000, 0, 0))
            e.do("advance 500ms")
            self.assertEqual(e.controller()["state"], "off")
            self.assertTrue(e.do("advance until idle")["idle"])
            self.assertEqual(e.do("state")["now_us"], 2500000)
            self.assertEqual(port.ask(b"C", 14), b"\x01" + point(24000, 0, 0) + CR)

    def test_a_fault_that_can_never_strike_is_refused(self):
        with Rehearsal("mpc") as e:
            for line, words in (("fault stall-axis x on C", "moves"), ("fault slow-motion on K", "moves"), ("fault slow-motion 1", "2"),
                                ("fault power-loss on U", "moves"), ("fault torn-frame on M", "streamed"),
                                ("fault ignore-stop on M", "^C"), ("fault slow-motion 3 3", "next")):
                self.assertIn(words, e.refuses(line), line)

    def test_settings(self):
        with Rehearsal("trio") as e, Port(e.path) as port:
            e.do("set position 100um,0um,25000um")
            e.do("set angle 45")
            self.assertEqual(port.ask(b"c", 14), point(1067, 0, 266667) + b"\x2d" + CR)
            e.do("set home 1,2,3")
            self.assertEqual(e.controller()["home_steps"], [1, 2, 3])
            e.do("set work 7,8,9")
            self.assertEqual(e.controller()["devices"][0]["work_steps"], [7, 8, 9])
            e.do("set work none")
            self.assertIsNone(e.controller()["devices"][0]["work_steps"])
            for line, words in (("set position 1,2", "X,Y,Z"), ("set position 0,0,266668", "travel"), ("set angle 91", "90"),
                                ("set mode 1", "TRIO"), ("set speed 1", "position"), ("set position", "X,Y,Z")):
                self.assertIn(words, e.refuses(line), line)
        with Rehearsal("mpc", "--clock", "step") as e, Port(e.path) as port:
            e.do("set position 2 16,0,0")
            e.do("set mode 7")
            e.do("set angle 45")
            state = e.controller()["devices"]
            self.assertEqual((state[1]["position_steps"], state[0]["mode"], state[0]["diagonal"]), ([16, 0, 0], 7, 7))
            self.assertIn("0,0,0", e.refuses("set home 1,1,1"))
            self.assertIn("no device", e.refuses("set position 3 1,1,1"))
            port.send(b"M" + point(16000, 0, 0))
            self.assertIn("moves", e.refuses("set position 1,1,1"))

    def test_quirks(self):
        with Rehearsal("mpc") as e, Port(e.path) as port:
            e.do("quirk position-13 on")
            self.assertEqual(port.ask(b"C", 13), point(0, 0, 0) + CR)
            self.assertEqual(e.controller()["quirks"], ["position-13"])
            e.do("quirk position-13 off")
            self.assertEqual(port.ask(b"C", 14), b"\x01" + point(0, 0, 0) + CR)
            self.assertIn("small-move-silent", e.refuses("quirk tired on"))
            self.assertIn("on or off", e.refuses("quirk position-13"))


class Later(unittest.TestCase):
    def test_at_in_after_and_on(self):
        with Rehearsal("mpc", "--clock", "step") as e, Port(e.path) as port:
            e.do("at 1s set position 16,0,0")
            e.do("in 2s set position 32,0,0")
            e.do("advance 999999us")
            self.assertEqual(e.position()[0], 0)
            e.do("advance 1us")
            self.assertEqual(e.position()[0], 16)
            e.do("advance until idle")  # scenarios do not make it go on
            self.assertEqual(e.position()[0], 16)
            e.do("advance 1s")
            self.assertEqual(e.position()[0], 32)
            e.do("after 3 commands set position 48,0,0")
            e.do("on K set position 2 64,0,0")
            self.assertEqual(port.ask(b"CC", 28)[1:3], b"\x20\x00")
            self.assertEqual(port.ask(b"C", 14)[1:3], b"\x20\x00")
            self.assertEqual((e.position()[0], e.position(2)[0]), (48, 0))
            port.ask(b"K", 4)
            self.assertEqual(e.position(2)[0], 64)

    def test_each(self):
        with Rehearsal("mpc", "--clock", "step") as e, Port(e.path) as port:
            e.do("on each active power cycle")
            for _ in range(3):
                port.send(b"K")
                e.do("advance 1s")
            self.assertEqual(port.receive(12), emu.ACTIVE[1] * 3)
            self.assertIn("active", e.refuses("on Q power off"))
            self.assertIn("Another command", e.refuses("on K"))
            self.assertIn("1000000", e.refuses("after x commands power off"))

    def test_what_has_struck_is_forgotten(self):
        """However many lines have waited and been carried out, the emulator is as big as before."""
        environment = dict(os.environ, ASAN_OPTIONS=os.environ.get("ASAN_OPTIONS", "") + ":quarantine_size_mb=0")
        with Rehearsal("mpc", "--clock", "step", env=environment) as e, Port(e.path) as port:
            def many():
                for _ in range(20):
                    for _ in range(100):
                        e.do("on K fault off")
                        e.do("after 1 commands fault off")
                        e.do("at 0s fault off")
                    self.assertEqual(port.ask(*emu.ACTIVE[:1], 4), emu.ACTIVE[1])
            many()
            before = self.resident_kib(e)
            many()  # 4,000 that wait for a command, of 600 bytes and more each
            self.assertLess(self.resident_kib(e) - before, 1024)

    def resident_kib(self, e):
        with open(f"/proc/{e.process.pid}/status", encoding="ascii") as file:
            return next(int(line.split()[1]) for line in file if line.startswith("VmRSS"))

    def test_do_at_the_start(self):
        with Rehearsal("mpc", "--do", "set position 16,0,0", "--do", "quirk position-13 on") as e, Port(e.path) as port:
            self.assertEqual(port.ask(b"C", 13), point(16, 0, 0) + CR)
        status, out, error = emu.outcome("mpc", "--do", "set position 1,2")
        self.assertEqual((status, out), (2, ""))
        self.assertIn("X,Y,Z", error)


class Channel(unittest.TestCase):
    def test_only_its_owner_may_use_it(self):
        with Rehearsal("mpc") as e:
            self.assertEqual(stat.S_IMODE(os.stat(e.socket_path).st_mode), 0o600)

    def test_ctl(self):
        with Rehearsal("mpc") as e:
            status, out, error = ctl(e.socket_path, "state")
            self.assertEqual((status, error), (0, ""))
            self.assertEqual(json.loads(out)["controllers"][0]["state"], "rest")
            self.assertEqual(ctl(e.socket_path, "power", "off")[0], 0)
            status, out, error = ctl(e.socket_path, "power", "off")
            self.assertEqual((status, out), (1, ""))
            self.assertIn("off", error)
            status, out, error = ctl(e.socket_path + "x", "state")
            self.assertEqual((status, out), (1, ""))
            self.assertIn("--control", error)

    def test_an_answer_is_json_whatever_was_said(self):
        with Rehearsal("mpc") as e, socket.socket(socket.AF_UNIX) as channel:
            channel.settimeout(emu.LIMIT_S)
            channel.connect(e.socket_path)
            lines = channel.makefile("rb")
            for said in (b"\xff", b"power \xe9t\xe9", b"fault drop-\xc3\xa9", b"@\xfc state", b"x" * 480 + b"\xc3\xa9\xc3"):
                channel.sendall(said + b"\n")
                answer = json.loads(lines.readline().decode("utf-8"))
                self.assertFalse(answer["ok"])
                self.assertIn("ASCII", answer["why"])
            channel.sendall(b"\x01\x7f\x1b[31m\n")
            self.assertIn("\x1b[31m", json.loads(lines.readline().decode("utf-8"))["why"])
            lines.close()

    def test_the_longest_line(self):
        """As dryrig-control(7) has it."""
        with Rehearsal("mpc") as e:
            self.assertTrue(e.say("state" + " " * 505)["ok"])

    def test_a_time_that_has_gone_by(self):
        with Rehearsal("mpc", "--clock", "step") as e:
            e.do("advance 5s")
            e.do("at 2s power off")  # at once
            self.assertEqual(e.controller()["state"], "off")

    def test_a_ninth_connection_takes_the_place_of_the_first(self):
        with Rehearsal("mpc") as e:
            channels = []
            for _ in range(8):
                channel = socket.socket(socket.AF_UNIX)
                self.addCleanup(channel.close)
                channel.settimeout(emu.LIMIT_S)
                channel.connect(e.socket_path)
                channels.append((channel, channel.makefile("rb")))
                channel.sendall(b"help quit\n")
                self.assertTrue(json.loads(channels[-1][1].readline())["ok"])
            with e.lines as first:
                self.assertEqual(json.loads(first.readline())["why"], "too many are connected")
                self.assertEqual(first.readline(), "")
            for channel, answers in channels:
                channel.sendall(b"state\n")
                self.assertTrue(json.loads(answers.readline())["ok"])
                answers.close()
            self.assertEqual(ctl(e.socket_path, "state")[0], 0)

    def test_quit_ends_it(self):
        with Rehearsal("mpc") as e:
            self.assertEqual(e.say("quit"), {"ok": True})
            self.assertEqual(e.process.wait(emu.LIMIT_S), 0)

    def test_help_lists_every_verb(self):
        with Rehearsal("mpc") as e:
            verbs = {entry["command"].split()[0] for entry in e.do("help")["commands"]}
            self.assertLessEqual({"state", "advance", "power", "device", "usb", "set", "quirk", "trace", "subscribe", "quit",
                                  "at", "in", "after", "on", "help"}, verbs)
            self.assertEqual(len(e.do("help power")["commands"]), 1)
            for line, words in (("", "help"), ("dance", "dance"), ("help dance", "dance"), ("@other state", "other"),
                                ("state now", "now"), (" ".join("x" * 30), "words"), ("x" * 600, "long")):
                self.assertIn(words, e.refuses(line), line)

    def test_trace(self):
        with emu.directory() as d:
            path = os.path.join(d, "trace")
            with Rehearsal("mpc", "--trace", path) as e, Port(e.path) as port:
                e.do("trace off")
                port.ask(b"K", 4)
                e.do("trace on")
                port.ask(b"C", 14)
            with open(path, encoding="ascii") as file:
                text = file.read()
            self.assertNotIn("> 4B", text)
            self.assertIn("> 43", text)
        with Rehearsal("mpc") as e:
            self.assertIn("--trace", e.refuses("trace on"))

    def test_subscribe(self):
        with Rehearsal("mpc", "--clock", "step") as e, Port(e.path) as port:
            other = socket.socket(socket.AF_UNIX)
            other.connect(e.socket_path)
            with other, other.makefile("rw", encoding="utf-8") as events:
                events.write("subscribe\n")
                events.flush()
                self.assertEqual(json.loads(events.readline()), {"ok": True})
                e.do("advance 1s")
                port.ask(b"K", 4)
                seen = [json.loads(events.readline()) for _ in range(4)]
            self.assertEqual([event["event"] for event in seen], ["from-host", "note", "note", "to-host"])
            self.assertEqual((seen[0]["bytes"], seen[3]["bytes"]), ("4B", "01 21 03 0D"))
            self.assertEqual((seen[1]["note"], seen[1]["command"], seen[1]["when_us"]), ("request", "active", 1000000))
            port.ask(b"K", 4)
            self.assertTrue(e.is_idle())

    def test_every_key_and_event_is_in_the_manual_page(self):
        with open(MANUAL, encoding="utf-8") as file:
            section = file.read().partition(".SH LOOKING ON")[2].partition('"trace on"')[0]
        told = set(re.findall(r"[a-z_-]+", "".join(line for line in section.splitlines(True) if line.startswith(".B"))))
        seen = []
        with Rehearsal("mpc", "--clock", "step") as e:
            other = socket.socket(socket.AF_UNIX)
            other.settimeout(emu.LIMIT_S)
            other.connect(e.socket_path)
            with other, other.makefile("rw", encoding="utf-8") as events:
                events.write("subscribe\n")
                events.flush()
                self.assertEqual(json.loads(events.readline()), {"ok": True})
                with Port(e.path) as port:
                    tty = termios.tcgetattr(port.fd)
                    tty[4] = tty[5] = termios.B57600
                    termios.tcsetattr(port.fd, termios.TCSANOW, tty)
                    e.do("fault slow-answer 1s on C")
                    self.assertEqual(port.ask(b"K", 4), emu.ACTIVE[1])
                    port.send(b"M" + point(16, 0, 0))
                    e.do("advance until idle")
                    emu.wait_until(lambda: port.waiting() == 1, "the CR")
                    port.send(b"C")
                    e.do("advance 1ms")
                e.do("state")  # by then it is known that nobody has the port open
                e.do("advance until idle")
                e.do("quit")
                seen = [json.loads(line) for line in events]
        self.assertEqual({"event": "end", "controller": "mpc"}, {key: seen[-1][key] for key in ("event", "controller")})
        self.assertEqual({event["event"] for event in seen},
                         {"from-host", "to-host", "lost", "note", "opened", "closed", "tty", "fault", "end"})
        self.assertEqual([event["baud"] for event in seen if event["event"] == "tty"], [57600])
        self.assertEqual([event["unread"] for event in seen if event["event"] == "closed"], [1])
        self.assertEqual({key for event in seen for key in event} - told, set())
        self.assertEqual({event["event"] for event in seen} - told, set())

    def test_a_subscriber_that_does_not_read_holds_nobody_up(self):
        with Rehearsal("mpc") as e, Port(e.path) as port:
            e.do("subscribe")
            for _ in range(3000):
                self.assertEqual(port.ask(b"C", 14)[:1], b"\x01")

    def test_a_socket_that_was_left_over_is_replaced_and_others_stay(self):
        with emu.directory() as d:
            path = os.path.join(d, "control")
            e = emu.Emulator("mpc", "--control", path)
            status, _, error = emu.outcome("mpc", "--control", path)
            self.assertEqual(status, 1)
            self.assertIn("in use", error)
            e.process.kill()
            e.process.communicate()
            with emu.Emulator("mpc", "--control", path):
                self.assertEqual(ctl(path, "state")[0], 0)
            self.assertEqual(os.listdir(d), [])
            with open(path, "w", encoding="ascii"):
                pass
            status, _, error = emu.outcome("mpc", "--control", path)
            self.assertEqual(status, 1)
            self.assertIn("no socket", error)

    def test_run_gives_the_command_a_channel(self):
        script = "import os, subprocess, sys; sys.exit(subprocess.call([sys.argv[1], 'ctl', os.environ['DRYRIG_CONTROL'], 'state']))"
        done = subprocess.run([emu.PROGRAM, "run", "mpc", "--", sys.executable, "-c", script, emu.PROGRAM],
                              capture_output=True, timeout=emu.LIMIT_S, check=False)
        self.assertEqual(done.returncode, 0, done)
        self.assertTrue(json.loads(done.stdout)["ok"])


class Rigs(unittest.TestCase):
    def test_a_controller_is_named_where_there_are_several(self):
        with emu.directory() as d:
            rig, path = os.path.join(d, "rig"), os.path.join(d, "control")
            with open(rig, "w", encoding="ascii") as file:
                file.write('controllers = ( { name = "a"; controller = "mpc"; do = [ "set position 16,0,0" ]; },'
                           ' { name = "b"; controller = "trio"; } );')
            process = emu.start("rig", rig, "--control", path)
            process.stdout.readline()
            status, out, _ = ctl(path, "state")
            self.assertEqual([c["devices"][0]["position_steps"][0] for c in json.loads(out)["controllers"]], [16, 10667])
            self.assertIn("@a", ctl(path, "power", "off")[2])
            self.assertEqual(ctl(path, "@b", "power", "off")[0], 0)
            _, out, _ = ctl(path, "@b", "state")
            self.assertEqual([c["state"] for c in json.loads(out)["controllers"]], ["off"])
            process.terminate()
            process.communicate(timeout=emu.LIMIT_S)
            self.assertEqual((status, process.returncode), (0, 0))


if __name__ == "__main__":
    emu.main()
