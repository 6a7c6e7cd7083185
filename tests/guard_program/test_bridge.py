"""dryrig-guard between a host and an emulator: what passes, what does not, what stops."""
import json
import os
import re
import resource
import socket
import subprocess
import tempfile
import threading

import emu
import guard
import realtime
from guard import Channel, Guard, guarded, line, move_mpc, position_mpc, rig

FAST = ("--pace", "off")


class Passing(realtime.TestCase):
    def both(self, kind, config, dialogue, *args):
        """The same answers through the guard as without it."""
        with emu.Emulator(kind, *FAST, *args) as alone, emu.Port(alone.path) as port:
            expected = [port.ask(question, count) for question, count in dialogue]
        with guarded(kind, config, *FAST, *args) as (_, g, port):
            self.assertEqual([port.ask(question, count) for question, count in dialogue], expected)
            self.assertEqual(g.status()["refused"], 0)
            self.assertEqual(port.waiting(), 0)

    def test_an_mpc_answers_through_the_guard_as_without_it(self):
        self.both("mpc", rig(guard.MPC), [
            (b"C", 14), (b"K", 4), (b"U", 6), (b"I\x01", 2), (b"F", 1), (b"L\x03", 1),
            (move_mpc(100, 200, 50), 1), (b"C", 14), (move_mpc(0, 0, 0), 1), (b"C", 14), (b"\x03", 1)])

    def test_an_mpc_of_old_firmware_answers_through_the_guard_as_without_it(self):
        config = rig(guard.MPC).replace('"3.21"', '"1.03"')
        self.both("mpc", config, [(b"C", 14), (b"K", 2), (b"A", 2), (move_mpc(100, 200, 50), 1), (b"C", 14)], "--firmware", "1.03")

    def test_an_mpc_without_manipulators_stays_locked(self):
        with emu.directory() as directory, emu.Emulator("mpc", *FAST, "--device", "none") as e:
            with Guard(directory, e.path, rig(guard.MPC), wait="locked") as g, emu.Port(g.path) as port:
                port.send(b"C")
                self.assertEqual(port.receive(1, 0.3), b"")
                self.assertEqual(g.order("arm")["ok"], False)

    def test_a_trio_answers_through_the_guard_as_without_it(self):
        point = emu.point
        self.both("trio", rig(guard.TRIO), [
            (b"C", 14), (b"c", 14), (b"A\x2d", 1), (b"C", 14), (b"x" + point(11000, 0, 0)[:4], 1), (b"C", 14),
            (b"H" + point(10600, 10700, 10800), 1), (b"W" + point(10900, 10800, 10700), 1),
            (b"S\x0f" + point(12000, 12000, 12000), 1), (b"C", 14), (b"\x03", 1)])

    def test_a_straight_line_of_an_mpc_gets_its_pause_from_the_guard(self):
        with guarded("mpc", rig(guard.MPC), "--quirks", "s-needs-pause") as (_, g, port):
            self.assertEqual(port.ask(line(15, 30, 40, 50), 1), b"\r") # in one write: without the guard it would hang
            self.assertEqual(position_mpc(port.ask(b"C", 14)), (30, 40, 50))
            self.assertEqual(g.status()["state"], "armed")

    def test_every_byte_value_in_a_position(self):
        with guarded("mpc", rig(guard.MPC), *FAST) as (_, _, port):
            for low in range(0, 256, 5):
                steps = (0x0300 | low, 0x0D00 | low, low << 8 | 0x03)
                self.assertEqual(port.ask(b"M" + emu.point(*steps), 1), b"\r")
                self.assertEqual(port.ask(b"C", 14), b"\x01" + emu.point(*steps) + b"\r")


class Refusing(realtime.TestCase):
    def test_a_way_through_an_obstacle_gets_no_answer_and_a_reason(self):
        with guarded("mpc", rig(guard.MPC, keepouts=guard.POST), *FAST) as (_, g, port):
            with Channel(g.socket) as follower:
                self.assertEqual(follower.order("follow")["last_refusal"], None)
                port.send(line(15, 4000, 4000, 0))
                while True:
                    told = follower.answer()
                    if told["refused"] == 1:
                        break
            self.assertEqual(told["last_refusal"]["command"], "line")
            self.assertEqual(told["last_refusal"]["reason"], "keep-out")
            self.assertIn("post", told["last_refusal"]["says"])
            emu.wait_until(lambda: g.status()["state"] == "armed", "armed again")
            self.assertEqual(port.ask(b"C", 14), b"\x01" + emu.point(0, 0, 0) + b"\r") # no CR came before
            self.assertEqual(port.ask(line(15, 0, 300, 0), 1), b"\r") # beside it
            self.assertIn("refused 'line': the way touches an obstacle: post", g.err())

    def test_out_of_the_box(self):
        with guarded("mpc", rig(guard.MPC, high=1000), *FAST) as (_, g, port):
            port.send(move_mpc(1001, 0, 0))
            emu.wait_until(lambda: g.status()["refused"] == 1, "the refusal")
            self.assertEqual(g.status()["last_refusal"]["reason"], "limit")
            self.assertEqual(port.ask(move_mpc(1000, 0, 0), 1), b"\r")

    def test_E_where_the_configuration_says_so(self):
        with guarded("mpc", rig(guard.MPC, high=1000, more='refusal = "E";'), *FAST) as (_, _, port):
            self.assertEqual(port.ask(move_mpc(1001, 0, 0), 1), b"E")

    def test_the_host_library_knows_E(self):
        """And the next command works: it is not out of step."""
        for kind, config, stage in (("mpc", guard.MPC, "MP-225"), ("trio", guard.TRIO, "MP-845")):
            with guarded(kind, rig(config, high=2000, more='refusal = "E"; stay_armed = true;'), *FAST) as (_, g, port):
                port.close()
                for words, error in (("move 2100 1000 1000", "refused"), ("line 2100 1000 1000 --speed 15", "refused"),
                                     ("line 1100 1000 1000 --speed 15", None)):
                    done = subprocess.run([os.environ["DRYRIG"], "-p", g.path, "-c", kind, "-s", stage, "--json", *words.split()],
                                          capture_output=True, timeout=emu.LIMIT_S, check=False)
                    told = json.loads(done.stdout.decode().splitlines()[-1])
                    self.assertEqual((words, told.get("error"), done.returncode), (words, error, 0 if error is None else 1))

    def test_nothing_moves_before_it_is_armed(self):
        with emu.directory() as directory, emu.Emulator("mpc", *FAST) as e, Guard(directory, e.path, rig(guard.MPC)) as g:
            with emu.Port(g.path) as port:
                port.send(move_mpc(100, 0, 0))
                emu.wait_until(lambda: g.status()["refused"] == 1, "the refusal")
                self.assertEqual(g.status()["last_refusal"]["reason"], "not-armed")
                self.assertEqual(port.ask(b"C", 14), b"\x01" + emu.point(0, 0, 0) + b"\r")

    def test_a_hostile_host_holds_nobody_up(self):
        # stderr is a pipe that nobody reads: it must not matter.
        reader, writer = os.pipe()
        with guarded("mpc", rig(guard.MPC, high=1000), *FAST, stderr=writer) as (_, g, port):
            os.close(writer)
            with Channel(g.socket) as deaf:
                deaf.order("follow")
                for i in range(2000):
                    port.send(bytes((7 * i + j) % 251 + 4 for j in range(64)))
                answer = g.order("stop")
                self.assertEqual((answer["ok"], answer["forwarded"]), (True, 0))
                self.assertGreater(answer["dropped_bytes"] + answer["refused"], 0)
        os.close(reader)


class Stopping(realtime.TestCase):
    def moving(self, g, port):
        port.send(line(0, 2000, 0, 0)) # 81 um/s
        g.wait_for("moving")

    def at_rest(self, port):
        first = position_mpc(port.ask(b"C", 14))
        guard.pause(0.1)
        self.assertEqual(position_mpc(port.ask(b"C", 14)), first)
        self.assertLess(first[0], 1900)
        return first

    def test_the_hosts_interrupt(self):
        with guarded("mpc", rig(guard.MPC)) as (_, g, port):
            self.moving(g, port)
            self.assertEqual(port.ask(b"\x03", 1), b"\r")
            g.wait_for("armed")
            self.at_rest(port)
            self.assertEqual(port.waiting(), 0)

    def test_the_second_channels_stop_is_latched_and_clearing_does_not_arm(self):
        with guarded("mpc", rig(guard.MPC)) as (e, g, port):
            self.moving(g, port)
            self.assertEqual(g.order("stop")["ok"], True)
            g.wait_for("stopped")
            self.assertEqual(port.receive(1, 0.2), b"") # no CR for a move that was not done
            self.at_rest(port)
            port.send(line(0, 0, 0, 0))
            emu.wait_until(lambda: g.status()["refused"] == 1, "the refusal")
            answer = g.order("arm")
            self.assertEqual((answer["ok"], answer["state"]), (False, "stopped"))
            answer = g.order("clear")
            self.assertEqual((answer["ok"], answer["state"], answer["next"]), (True, "disarmed", "confirm"))
            g.arm()
            self.assertEqual(port.ask(line(15, 10, 0, 0), 1), b"\r")
            self.assertIsNone(e.process.poll())

    def test_a_stop_that_is_cleared_at_once_is_told_as_one(self):
        with guarded("mpc", rig(guard.MPC)) as (_, g, port), Channel(g.socket) as channel:
            self.moving(g, port)
            channel.socket.sendall(b"stop\nclear\n")
            channel.answer()
            self.assertEqual((channel.answer()["state"], g.status().get("disarmed_says")), ("disarmed", None))
            emu.wait_until(lambda: "disarmed" in g.err().split("dryrig-guard: stopped")[-1], "the words")
            self.assertIn("dryrig-guard: stopped", g.err())

    def test_an_order_without_the_end_of_its_line(self):
        with guarded("mpc", rig(guard.MPC)) as (_, g, port), Channel(g.socket) as channel:
            self.moving(g, port)
            channel.socket.sendall(b"stop")
            channel.socket.shutdown(socket.SHUT_WR)
            self.assertEqual(channel.answer()["ok"], True)
            g.wait_for("stopped")

    def test_disarming_stops(self):
        with guarded("mpc", rig(guard.MPC)) as (_, g, port):
            self.moving(g, port)
            g.order("disarm")
            g.wait_for("disarmed")
            self.at_rest(port)

    def test_a_host_that_goes_away(self):
        with guarded("mpc", rig(guard.MPC)) as (_, g, port):
            self.moving(g, port)
            port.close()
            g.wait_for("disarmed")
            self.assertEqual(g.status()["disarmed_says"], "the host's program has closed the port")
            emu.wait_until(lambda: "disarmed: the host's program has closed the port\n" in g.err(), "the words")
            with emu.Port(g.path) as again:
                self.at_rest(again)

    def test_why_it_is_disarmed_is_told(self):
        with guarded("mpc", rig(guard.MPC, more="arm_idle_s = 1;")) as (_, g, port), Channel(g.socket) as follower:
            self.assertNotIn("disarmed_says", follower.order("follow"))
            g.order("disarm")
            self.assertEqual(self.until(follower, "disarmed")["disarmed_says"], "somebody has said so")
            g.arm()
            self.until(follower, "armed")
            port.close()
            self.assertEqual(self.until(follower, "disarmed")["disarmed_says"], "the host's program has closed the port")
            with emu.Port(g.path):
                g.arm()
                self.until(follower, "armed")
                self.assertEqual(self.until(follower, "disarmed")["disarmed_says"], "nothing was moved for a while (arm_idle_s)")
                g.arm()
                self.until(follower, "armed")
                g.order("clear")
                self.assertEqual(self.until(follower, "disarmed")["disarmed_says"], "somebody has said 'clear'")
                g.arm()
                self.until(follower, "armed")
                g.order("tip-changed")
                self.assertEqual(self.until(follower, "disarmed")["disarmed_says"], "the tip was changed")

    def test_stderr_tells_how_many_refusals_it_left_out(self):
        """One refusal a second at most, with the number of those before it: nothing seems to have passed that did not."""
        with guarded("mpc", rig(guard.MPC, high=1000)) as (_, g, port):
            g.order("disarm")
            for n in range(1, 6):
                port.send(move_mpc(10 * n, 0, 0))
                emu.wait_until(lambda: g.status()["refused"] == n, "the refusal")
            emu.wait_until(lambda: self.refusals_told(g) == 5, "all of them to be told")
            self.assertIn(f"more before it: 'dryrig-guard ctl {g.socket} log' tells each\n", g.err())
            port.send(move_mpc(60, 0, 0) + move_mpc(70, 0, 0))
            emu.wait_until(lambda: g.status()["refused"] == 7, "the refusals")
            g.stop() # which does not wait for the second
            self.assertEqual(self.refusals_told(g), 7)

    def test_who_was_never_there_has_not_closed_the_port(self):
        with emu.directory() as directory, emu.Emulator("mpc", *FAST) as e, Guard(directory, e.path, rig(guard.MPC)) as g:
            g.arm()
            g.order("stop")
            while g.status()["state"] == "stopping": # somebody else's terminals come and go
                for fd in os.openpty():
                    os.close(fd)
            self.assertEqual(g.order("clear")["state"], "disarmed")
            self.assertNotIn("disarmed_says", g.status())

    def test_calibration_is_not_announced_where_the_configuration_forbids_it(self):
        with emu.directory() as directory, emu.Emulator("trio", *FAST) as e, Guard(directory, e.path, rig(guard.TRIO)) as g:
            answer = g.order("allow-calibrate")
            self.assertEqual((answer["ok"], answer["may_calibrate"]), (False, False))
            self.assertIn("has no 'allow_calibrate = true'", answer["why"])

    @staticmethod
    def refusals_told(g):
        return g.err().count("refused 'move'") + sum(int(n) for n in re.findall(r"and (\d+) more before it", g.err()))

    @staticmethod
    def until(follower, state):
        told = follower.answer()
        while told["state"] != state:
            told = follower.answer()
        return told

    def test_a_stop_gets_through_whatever_is_held_up(self):
        """stderr, a follower, a recording and the host's port are full and nobody reads them: a stop passes by all of them, and at
        any time of a move. (How soon is for virtual time to say: tests/guard.)"""
        with emu.directory() as where:
            fifo = os.path.join(where, "line.rec")
            os.mkfifo(fifo)
            reader, writer = os.pipe()
            with guarded("mpc", rig(guard.MPC), guard_args=("--record", fifo), stderr=writer) as (_, g, port), Channel(
                    g.socket) as deaf:
                os.close(writer)
                deaf.order("follow")
                for _ in range(2000):
                    port.send(b"\xee" * 64)
                emu.wait_until(lambda: g.status()["dropped_bytes"] == 2000 * 64, "the last of it")
                guard.pause(0.1) # for the parser: it waits for 50 ms of silence
                for i in range(10):
                    g.arm()
                    self.moving(g, port)
                    guard.pause(0.013 * i)
                    port.send(b"C" * 50) # they come to nothing while it moves
                    if i % 2 == 0:
                        port.send(b"\x03")
                    else:
                        g.order("stop")
                        g.wait_for("stopped")
                        self.assertEqual(g.order("clear")["ok"], True)
                        g.arm()
                    g.wait_for("armed")
                    if i % 2 == 0:
                        self.assertEqual(port.receive(1), b"\r")
                    self.assertEqual(port.receive(1, 0.05), b"")
                self.at_rest(port)
            os.close(reader)

    def test_a_terminal_that_nobody_reads_holds_nothing_up(self):
        """It says that it can be written to while it has less room than a line."""
        reader, terminal = os.openpty()
        with guarded("trio", rig(guard.TRIO), stderr=terminal) as (_, g, port):
            os.close(terminal)
            for _ in range(180):
                self.assertEqual(g.order("disarm")["state"], "disarmed")
                g.arm()
            port.send(line(0, 1000, 0, 0))
            g.wait_for("moving")
            self.assertTrue(g.order("stop")["ok"])
            g.wait_for("stopped")
        os.close(reader)

    def test_orders_as_they_are_typed(self):
        with guarded("trio", rig(guard.TRIO)) as (_, g, _):
            for said in ("STOP", " stop ", "stop\r", "Stop\t\r"):
                self.assertTrue(g.order(said)["ok"], said)
                g.wait_for("stopped")
                self.assertTrue(g.order("Clear\r")["ok"])
            for said in ("stop now", "sto", "stopp", "s top", "stop" + 100 * " x", ""):
                self.assertFalse(g.order(said)["ok"], said)

    def test_followers_are_not_told_of_queries(self):
        with guarded("mpc", rig(guard.MPC), *FAST) as (_, g, port), Channel(g.socket) as follower:
            follower.order("follow")
            for _ in range(50):
                self.assertEqual(len(port.ask(b"C", 14)), 14)
            g.order("disarm")
            told = follower.answer()
            if told["state"] == "armed": # the end of the query that was under way when following began
                told = follower.answer()
            self.assertEqual((told["state"], told["disarmed_says"]), ("disarmed", "somebody has said so"))

    def test_a_stop_from_another_thread_within_the_frame(self):
        """acq4 writes it while its move thread sleeps behind the S and its speed."""
        frame = line(0, 2000, 0, 0)
        with guarded("mpc", rig(guard.MPC)) as (_, g, port):
            port.send(frame[:2])
            guard.pause(0.015)
            port.send(b"\x03")
            guard.pause(0.015)
            port.send(frame[2:])
            emu.wait_until(lambda: g.status()["dropped_bytes"] + g.status()["refused"] > 0, "the shifted frame to be refused")
            self.assertEqual(g.status()["forwarded"], 0)
            guard.pause(0.2) # as a person does before the next try
            self.assertEqual(port.ask(line(15, 10, 0, 0), 1), b"\r")
            self.moving(g, port)
            port.send(frame[:2]) # and while it moves: the next command is begun, and stopped within
            port.send(b"\x03")
            self.assertEqual(port.receive(1), b"\r")
            g.wait_for("armed")
            self.at_rest(port)

    def test_a_rig_whose_guard_stays_armed(self):
        with guarded("mpc", rig(guard.MPC, more="stay_armed = true;")) as (_, g, port):
            port.close()
            emu.wait_until(lambda: not g.status()["host_open"], "the port to be closed")
            self.assertEqual(g.status()["state"], "armed")
            with emu.Port(g.path) as again:
                self.assertEqual(again.ask(line(15, 10, 0, 0), 1), b"\r")
                self.moving(g, again) # a move is stopped all the same, and that disarms
            g.wait_for("disarmed")
            self.assertEqual(g.status()["disarmed_says"], "the host's program has closed the port")

    def test_half_a_command_goes_with_the_program_that_began_it(self):
        frame = line(15, 100, 0, 0)
        with guarded("mpc", rig(guard.MPC, more="stay_armed = true;")) as (_, g, port):
            for cut in (1, 2, 7, 13):
                for gap_s in (0, 0.01):
                    g.wait_for("armed")
                    port.send(frame[:cut])
                    port.close()
                    guard.pause(gap_s)
                    port = emu.Port(g.path)
                    port.send(frame[cut:])
                    guard.pause(0.15) # what could begin has begun; and what is no command is forgotten
                    emu.wait_until(lambda: g.status()["state"] in ("armed", "disarmed"), "rest")
                    if g.status()["state"] == "disarmed": # all of it was there before the port was seen to be closed
                        g.arm()
                    self.at_rest(port)
                    self.assertEqual(guard.position_mpc(port.ask(b"C", 14)), (0, 0, 0))
            port.close()

    def test_a_guard_that_is_ended_stops_what_moves(self):
        with emu.directory() as directory, emu.Emulator("mpc") as e:
            with Guard(directory, e.path, rig(guard.MPC)) as g, emu.Port(g.path) as port:
                g.arm()
                self.moving(g, port)
            with emu.Port(e.path) as port:
                self.at_rest(port)


class Orders(realtime.TestCase):
    def test_escape(self):
        with emu.directory() as directory, emu.Emulator("mpc", *FAST, "--position", "1100um,0um,0um") as e:
            with Guard(directory, e.path, rig(guard.MPC, high=1000)) as g, emu.Port(g.path) as port:
                answer = g.order("arm")
                self.assertEqual((answer["ok"], [need["need"] for need in answer["needs"]]), (False, ["inside"]))
                self.assertEqual(g.order("escape on")["escape"], True)
                g.arm()
                port.send(line(15, 1150, 0, 0)) # farther out
                emu.wait_until(lambda: g.status()["refused"] == 1, "the refusal")
                self.assertEqual(g.status()["last_refusal"]["reason"], "escape")
                self.assertEqual(port.ask(line(15, 990, 0, 0), 1), b"\r")
                g.order("disarm")
                self.assertEqual(g.status()["escape"], False) # once armed, once allowed
                g.arm()

    def test_a_surface_wants_a_persons_word(self):
        surface = 'surface = { retract = "-z"; at_um = 8000; clearance_um = 500; approach = (0, 0, 1); };'
        with emu.directory() as directory, emu.Emulator("mpc", *FAST) as e:
            with Guard(directory, e.path, rig(guard.MPC, drive=surface)) as g, emu.Port(g.path) as port:
                answer = g.order("arm")
                self.assertEqual((answer["ok"], answer["next"]), (False, "confirm"))
                self.assertIn("surface", [need["need"] for need in answer["needs"]])
                self.assertEqual(g.order("surface on")["in_tissue"], True)
                g.arm()
                port.send(line(3, 100, 0, 0))
                emu.wait_until(lambda: g.status()["refused"] == 1, "the refusal")
                self.assertEqual(g.status()["last_refusal"]["reason"], "approach")
                self.assertEqual(g.order("surface off")["in_tissue"], False)
                self.assertEqual(port.ask(line(3, 100, 0, 0), 1), b"\r")

    def test_a_changed_tip_wants_confirmation(self):
        with guarded("mpc", rig(guard.MPC), *FAST) as (_, g, _):
            self.assertEqual(g.order("tip-changed")["state"], "disarmed")
            answer = g.order("arm")
            self.assertEqual((answer["ok"], [need["need"] for need in answer["needs"]]), (False, ["tip"]))
            self.assertEqual(g.order("confirm")["confirm_wanted"], False)
            g.arm()

    def test_calibrating_takes_leave(self):
        with guarded("mpc", rig(guard.MPC, more="allow_calibrate = true;"), *FAST) as (_, g, port):
            port.send(b"N")
            emu.wait_until(lambda: g.status()["refused"] == 1, "the refusal")
            self.assertEqual(g.status()["last_refusal"]["reason"], "calibrate")
            self.assertEqual(g.order("allow-calibrate")["may_calibrate"], True)
            self.assertEqual(port.ask(b"N", 1), b"\r")

    def test_nonsense_is_told(self):
        with guarded("mpc", rig(guard.MPC), *FAST) as (_, g, _):
            for order in ("", "arms", "arm now", "surface", "surface maybe", "log x", "log 12x", "\x03"):
                answer = g.order(order)
                self.assertEqual((order, answer["ok"]), (order, False))
                self.assertIn("no such order", answer["why"])
            with Channel(g.socket) as channel:
                channel.socket.sendall(b"x" * 4000)
                self.assertEqual(channel.answer()["why"], "the line is too long")
            with Channel(g.socket) as channel: # in pieces, and two at once
                channel.socket.sendall(b"sta")
                channel.socket.sendall(b"tus\nstatus\n")
                self.assertEqual([channel.answer()["ok"], channel.answer()["ok"]], [True, True])

    def test_a_stop_gets_in_where_every_place_is_taken(self):
        with guarded("mpc", rig(guard.MPC), *FAST) as (_, g, _):
            channels = [Channel(g.socket) for _ in range(8)]
            for channel in channels:
                self.assertEqual(channel.order("status")["ok"], True)
            self.assertEqual(guard.run("ctl", g.socket, "stop")[0], 0)
            self.assertEqual(channels[0].answer()["why"], "too many are connected")
            with self.assertRaises(AssertionError):
                channels[0].answer()
            for channel in channels[1:]:
                self.assertIn(channel.order("status")["state"], ("stopping", "stopped"))
            for channel in channels:
                channel.close()

    def test_a_guard_that_hangs_up_is_told_of(self):
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, "sock")
            with socket.socket(socket.AF_UNIX) as deaf:
                deaf.bind(path)
                deaf.listen()
                for _ in range(5):  # before or after the order was written
                    hangs_up = threading.Thread(target=lambda: deaf.accept()[0].close())
                    hangs_up.start()
                    status, _, err = guard.run("ctl", path, "stop")
                    hangs_up.join()
                    self.assertEqual((status, "the guard does not answer" in err), (1, True), err)

    def test_the_program_gives_orders_too(self):
        with guarded("mpc", rig(guard.MPC), *FAST) as (_, g, _):
            status, out, _ = guard.run("ctl", g.socket, "status")
            self.assertEqual(status, 0)
            self.assertIn("state:    armed", out)
            self.assertEqual(guard.run("ctl", g.socket, "disarm")[0], 0)
            self.assertEqual(guard.run("ctl", g.socket, "stop")[0], 0)
            status, out, err = guard.run("ctl", g.socket, "arm")
            self.assertEqual(status, 4)
            self.assertIn("not armed", err)
            self.assertIn(f"next:     dryrig-guard ctl {g.socket} clear", out)
            self.assertEqual(guard.run("ctl", g.socket, "clear")[0], 0)
            self.assertEqual(guard.run("ctl", g.socket, "surface", "off")[0], 0)
            status, out, _ = guard.run("ctl", "--json", g.socket, "log", "3")
            self.assertEqual((status, out.count('"event"')), (0, 3))
            follower = subprocess.Popen([guard.PROGRAM, "ctl", g.socket, "status", "--follow"], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
            self.assertEqual(follower.stdout.readline(), "\n")
        out, err = follower.communicate(timeout=emu.LIMIT_S)
        self.assertEqual((follower.returncode, err), (0, f"dryrig-guard: {g.socket}: the guard has ended, or has hung up\n"), out)
        status, _, err = guard.run("ctl", g.socket, "status")
        self.assertEqual(status, 1)
        self.assertIn("Does a guard run with --control there?", err)


class SerialPort(realtime.TestCase):
    """The way to a real port, by libserialport, on a pseudo-terminal that is made to look like one."""

    @staticmethod
    def env(port):
        asan = os.environ.get("ASAN_OPTIONS", "")
        return {**os.environ, "LD_PRELOAD": os.environ["DRYRIG_SHIM"], "DRYRIG_SHIM_PTY": port,
                "ASAN_OPTIONS": f"{asan}:verify_asan_link_order=0"}

    def test_a_move_through_it_and_the_port_lost(self):
        with emu.directory() as directory, emu.Emulator("mpc", *FAST) as e:
            with Guard(directory, "/dev/ttyEMU0", rig(guard.MPC), env=self.env(e.path)) as g, emu.Port(g.path) as port:
                g.arm()
                self.assertEqual(port.ask(line(15, 30, 40, 50), 1), b"\r")
                self.assertEqual(position_mpc(port.ask(b"C", 14)), (30, 40, 50))
                e.stop()
                g.wait_for("locked")
                self.assertIn("/dev/ttyEMU0: it is gone", g.status()["device_says"])

    def test_a_converter_with_another_number_is_not_taken(self):
        config = rig(guard.MPC, more='converter_serial = "FT123";')
        with emu.directory() as directory, emu.Emulator("mpc", *FAST) as e:
            for port, env in (("/dev/ttyEMU0", self.env(e.path)), (e.path, None)):
                with Guard(directory, port, config, wait="locked", env=env) as g:
                    self.assertIn("the configuration is for FT123", g.status()["device_says"])
                    self.assertEqual(g.order("arm")["ok"], False)


class Log(realtime.TestCase):
    def test_it_is_whole_and_tampering_shows(self):
        with guarded("mpc", rig(guard.MPC, high=1000), *FAST) as (_, g, port):
            port.ask(move_mpc(10, 20, 30), 1)
            port.send(move_mpc(1001, 0, 0))
            emu.wait_until(lambda: g.status()["refused"] == 1, "the refusal")
            g.stop()
            status, out, _ = guard.run("log", g.log)
            self.assertEqual(status, 0, out)
            self.assertIn("of 1 starts", out)
            with open(g.log, encoding="utf-8") as file:
                lines = file.readlines()
            self.assertTrue(any(" allowed " in one and "move" in one for one in lines))
            self.assertTrue(any(" refused " in one and "limit on axis X" in one for one in lines))
            for spoiled, where in ((lines[:5] + lines[6:], 6), (lines[:3] + [lines[3].replace("#0", "#1", 1)] + lines[4:], 4),
                                   (lines[:4] + [lines[2]] + lines[4:], 5), (lines[:-1] + [lines[-1][:-9] + "\n"], len(lines))):
                with open(g.log, "w", encoding="utf-8") as file:
                    file.writelines(spoiled)
                status, _, err = guard.run("log", g.log)
                self.assertEqual(status, 4)
                self.assertIn(f"{g.log}:{where}: ", err)

    def test_a_log_that_cannot_be_written_disarms(self):
        def small_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (6000, 6000))
        with emu.directory() as directory, emu.Emulator("mpc", *FAST) as e:
            g = Guard(directory, e.path, rig(guard.MPC), preexec_fn=small_files)
            with g, emu.Port(g.path) as port:
                g.order("arm")
                for _ in range(40):
                    port.ask(b"C", 14)
                g.wait_for("disarmed")
                answer = g.order("arm")
                self.assertEqual((answer["ok"], [need["need"] for need in answer["needs"]]), (False, ["log"]))
                self.assertEqual(g.err().count("/log cannot be written"), 1)
                self.assertEqual(guard.run("log", g.log)[0], 4) # the last line is cut off, and that shows
                os.truncate(g.log, 0) # somebody has made room, and nothing else happens until they say
                g.arm()
                self.assertEqual(port.ask(move_mpc(10, 20, 30), 1), b"\r")


class Rest(realtime.TestCase):
    def test_idle_costs_nothing(self):
        with guarded("mpc", rig(guard.MPC), *FAST) as (_, g, port):
            port.ask(b"C", 14)
            g.order("disarm")

            def is_idle():
                before = g.switches()
                guard.pause(1.0)
                return g.switches() - before < 50
            # Others open and close terminals meanwhile, and each is an event of the directory that is watched.
            emu.wait_until(is_idle, "a second of rest")

    def test_a_host_that_does_not_read_holds_nobody_up(self):
        with guarded("mpc", rig(guard.MPC), *FAST) as (_, g, port):
            writer = threading.Thread(target=lambda: [port.send(b"C") or guard.pause(0.002) for _ in range(3000)])
            writer.start()
            writer.join(emu.LIMIT_S)
            self.assertEqual(g.order("stop")["ok"], True)


if __name__ == "__main__":
    guard.main()
