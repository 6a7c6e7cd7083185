"""Every fault through the port: what the host sees where it strikes, and that it leaves the next exchange alone."""
import unittest

import emu
from ctl import Rehearsal
from emu import Port, point

CR = b"\r"
K, ACTIVE = emu.ACTIVE
AT_0 = b"\x01" + point(0, 0, 0) + CR


class Faults(unittest.TestCase):
    def setUp(self):
        self.e = Rehearsal("mpc", "--clock", "step", "--seed", "7").__enter__()
        self.port = Port(self.e.path)

    def tearDown(self):
        self.port.close()
        self.e.__exit__(None, None, None)

    def ask(self, request):
        """All that is answered in no time: what waits when the emulator has taken the request in."""
        self.port.send(request)
        self.e.do("state")
        return self.port.receive(200, 0.1)

    def healthy(self):
        self.assertEqual(self.ask(K), ACTIVE)
        self.assertEqual(self.ask(b"C")[:1], b"\x01")

    def test_drop_byte(self):
        self.e.do("fault drop-byte")
        got = self.ask(b"C")
        self.assertEqual(len(got), 13)
        self.healthy()

    def test_duplicate_byte(self):
        self.e.do("fault duplicate-byte on active")
        self.healthy_until_active()
        got = self.ask(K)
        self.assertEqual(len(got), 5)
        self.assertIn(ACTIVE, [got[:i] + got[i + 1:] for i in range(5)])
        self.healthy()

    def healthy_until_active(self):
        self.assertEqual(self.ask(b"C"), AT_0)

    def test_corrupt_byte(self):
        self.e.do("fault corrupt-byte")
        got = self.ask(b"C")
        self.assertEqual(len(got), 14)
        self.assertEqual(sum(bin(a ^ b).count("1") for a, b in zip(got, AT_0)), 1)
        self.healthy()

    def test_delay_byte_and_slow_answer(self):
        for fault in ("delay-byte 300ms", "slow-answer 300ms"):
            self.e.do(f"fault {fault}")
            got = self.ask(K)
            self.assertLess(len(got), 4)
            self.e.do("advance 299999us")
            self.assertEqual(self.port.receive(4, 0.1), b"")
            self.e.do("advance 1us")
            self.assertEqual(got + self.port.receive(4 - len(got)), ACTIVE)
            self.healthy()

    def test_drop_cr(self):
        self.e.do("fault drop-cr next 2")
        self.assertEqual(self.ask(K), ACTIVE[:3])
        self.assertEqual(self.ask(b"C"), AT_0[:13])
        self.healthy()

    def test_late_cr(self):
        self.e.do("fault late-cr 2s on move")
        self.healthy()
        self.port.send(b"M" + point(48, 0, 0))  # 1 ms
        self.e.do("advance 2000999us")
        self.assertEqual(self.port.receive(1, 0.1), b"")
        self.e.do("advance 1us")
        self.assertEqual(self.port.receive(1), CR)
        self.healthy()

    def test_stray_bytes(self):
        self.e.do("fault stray-bytes")
        got = self.ask(K)
        self.assertEqual((len(got), got[2:]), (6, ACTIVE))
        self.healthy()

    def test_lose_host_byte(self):
        self.e.do("fault lose-host-byte")
        self.assertEqual(self.ask(K), b"")
        self.healthy()

    def test_ignore_stop(self):
        self.e.do("fault ignore-stop")
        self.port.send(b"M" + point(48, 0, 0))
        self.assertEqual(self.ask(b"\x03"), b"")
        self.e.do("advance until idle")
        self.assertEqual(self.port.receive(1), CR)
        self.assertEqual(self.ask(b"\x03"), CR)

    def test_frames(self):
        self.assertEqual(self.ask(b"O"), CR)
        frame = b"\xff\xff\xff" + (16).to_bytes(3, "little") + bytes(6)
        self.e.do("fault short-frame")
        self.port.send(b"S\x0f" + point(32, 0, 0))
        self.e.do("advance until idle")
        got = self.port.receive(24, 0.1)
        self.assertLess(len(got), 24)
        self.assertGreater(len(got), 13)
        self.assertEqual(got[-13:-10] + got[-1:], b"\xff\xff\xff" + CR)
        self.e.do("set position 0,0,0")
        self.e.do("fault torn-frame 1s")
        self.port.send(b"S\x0f" + point(16, 0, 0))
        self.e.do("advance 500ms")
        self.assertEqual(self.port.receive(12, 0.1), frame[:6])
        self.e.do("advance 1s")
        self.assertEqual(self.port.receive(7), frame[6:] + CR)
        self.healthy()

    def test_wedge(self):
        self.e.do("fault wedge on C")
        self.assertEqual(self.ask(K), ACTIVE)
        self.assertEqual(self.ask(b"C"), b"")
        self.assertEqual(self.ask(K + b"\x03"), b"")
        self.assertEqual(self.e.controller()["state"], "wedged")
        self.e.do("power cycle")
        self.healthy()

    def test_stall_axis(self):
        self.e.do("fault stall-axis x")
        self.port.send(b"M" + point(16000, 16000, 0))
        self.e.do("advance until idle")
        self.assertEqual(self.port.receive(1), CR)
        self.assertEqual(self.ask(b"C"), b"\x01" + point(8000, 16000, 0) + CR)
        self.port.send(b"M" + point(16000, 16000, 0))
        self.e.do("advance until idle")
        self.assertEqual(self.port.receive(1), CR)
        self.assertEqual(self.ask(b"C"), b"\x01" + point(16000, 16000, 0) + CR)

    def test_slip_axis(self):
        self.e.do("fault slip-axis z")
        self.port.send(b"M" + point(16000, 0, 16000))
        self.e.do("advance 100ms")
        self.assertEqual(self.e.controller()["devices"][0]["tip_steps"][2], 0)
        self.e.do("advance until idle")
        self.assertEqual(self.port.receive(1), CR)
        self.assertEqual(self.ask(b"C"), b"\x01" + point(16000, 0, 16000) + CR)
        self.port.send(b"M" + point(0, 0, 20000))
        self.e.do("advance until idle")
        self.assertEqual(self.port.receive(1), CR)
        device = self.e.controller()["devices"][0]
        self.assertEqual((device["position_steps"], device["tip_steps"]), ([0, 0, 20000], [0, 0, 4000]))

    def test_power_loss_and_usb_in_mid_move_are_lines_that_wait(self):
        self.e.do("on M in 250ms power off")
        self.port.send(b"M" + point(400000, 0, 0))
        self.e.do("advance 1s")
        self.e.do("power on")
        self.assertEqual(self.ask(b"C"), b"\x01" + point(400000 * 250000 // 8333334, 0, 0) + CR)
        self.e.do("on M in 250ms usb unplug 1s")
        self.port.send(b"M" + point(0, 0, 0))
        self.e.do("advance 250ms")
        self.assertIsNone(self.e.controller()["port"])
        self.e.do("advance 1s")
        self.port.close()
        self.port = Port(self.e.link)
        self.healthy()

    def test_always_and_off(self):
        self.e.do("fault drop-cr always on active")
        for _ in range(5):
            self.assertEqual(self.ask(K), ACTIVE[:3])
        self.assertEqual(self.e.do("faults")["active"], [{"fault": "drop-cr", "command": "active"}])
        self.e.do("fault stall-axis z")
        self.assertEqual(self.e.do("faults")["active"][1], {"fault": "stall-axis", "axis": "z", "left": 1})
        self.e.do("fault late-cr off")
        self.assertEqual(self.ask(K), ACTIVE[:3])
        self.e.do("fault drop-cr off")
        self.healthy()
        self.e.do("fault drop-cr")
        self.e.do("fault off")
        self.healthy()

    def test_between_times(self):
        self.e.do("fault drop-cr from 1s until 2s")
        self.assertEqual(self.ask(K), ACTIVE)
        self.e.do("advance 1s")
        self.assertEqual(self.ask(K), ACTIVE[:3])
        self.assertEqual(self.ask(K), ACTIVE[:3])
        self.e.do("advance 1s")
        self.healthy()

    def test_chance_is_the_same_for_the_same_seed(self):
        def run(seed):
            with Rehearsal("mpc", "--clock", "step", "--seed", seed) as e, Port(e.path) as port:
                e.do("fault drop-cr chance 30%")
                port.send(K * 200)
                e.do("state")
                return port.receive(800, 0.2)
        first = run("1")
        self.assertEqual(first, run("1"))
        self.assertNotEqual(first, run("2"))
        self.assertGreater(800 - len(first), 30)
        self.assertLess(800 - len(first), 90)

    def test_a_seed_that_was_chosen_is_told(self):
        with Rehearsal("mpc", "--do", "fault corrupt-byte") as e, Port(e.path) as port:
            port.ask(b"C", 14)
        self.assertRegex(e.err, r"--seed \d+")
        with Rehearsal("mpc") as e, Port(e.path) as port:
            port.ask(b"C", 14)
        self.assertNotIn("--seed", e.err)

    def test_what_is_refused(self):
        for line, words in (("fault", "drop-cr"), ("fault tired", "drop-cr"), ("fault drop-cr sometimes", "chance"),
                            ("fault drop-cr next 0", "1000000"), ("fault stall-axis", "x, y or z"), ("fault late-cr 5", "unit"),
                            ("fault drop-cr on Q", "active"), ("fault drop-cr chance 2", "probability"),
                            ("fault drop-cr from now", "unit"), ("fault lose-host-byte on C", "no command")):
            self.assertIn(words, self.e.refuses(line), line)
        for _ in range(32):
            self.e.do("fault drop-cr")
        self.assertIn("32", self.e.refuses("fault drop-cr"))

    def test_every_fault_is_listed(self):
        names = {entry["fault"] for entry in self.e.do("faults")["faults"]}
        self.assertEqual(names, {"drop-byte", "delay-byte", "duplicate-byte", "corrupt-byte", "drop-cr", "late-cr", "stray-bytes",
                                 "slow-answer", "short-frame", "torn-frame", "lose-host-byte", "ignore-stop", "wedge",
                                 "stall-axis", "slip-axis", "slow-motion", "power-loss", "power-loss-forget", "usb-unplug"})


if __name__ == "__main__":
    emu.main()
