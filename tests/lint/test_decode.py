"""dryrig decode: bytes of the manuals' tables ([T] table 6, [M] table 9, note 16), explained one by one."""
import os
import subprocess
import tempfile
import unittest

PROGRAM = os.environ["DRYRIG"]


def decode(*args):
    done = subprocess.run([PROGRAM, *args], stdin=subprocess.DEVNULL, capture_output=True, timeout=60, check=False)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def lines(text):
    return [" ".join(line.split()) for line in text.splitlines()]


class Bytes(unittest.TestCase):
    def test_a_command_byte_by_byte(self):
        status, out, _ = decode("-c", "mpc", "-s", "MP-225", "decode", "53 0F 80 3E 00 00 00 00 00 00 01 00 00 00")
        self.assertEqual(status, 0)
        got = lines(out)
        self.assertEqual(len(got), 1 + 14)
        self.assertEqual(got[2], "1 0F moves at speed 15 (1,300.0 um/s) ([M] table 10); 30 ms of pause belong behind it")
        self.assertEqual(got[3], "2 80 X, byte 1 of 4 (least significant): 128")
        self.assertEqual(got[4], "3 3E X, byte 2 of 4: 62 x 256 = 15,872")
        self.assertTrue(got[6].endswith("together X 1,000.0 um (16,000 steps)"))

    def test_the_same_stage_has_other_microsteps_on_the_other_controller(self):
        frame = "80 3E 00 00 00 00 00 00 00 00 00 00"
        self.assertIn("X 750.0 um", decode("-c", "mpc", "-s", "MP-845", "decode", "4D " + frame)[1])
        self.assertIn("X 1,500.0 um", decode("-c", "trio", "-s", "MP-845", "decode", "48 " + frame)[1])

    def test_an_answer_belongs_to_its_question(self):
        status, out, _ = decode("-c", "trio", "-s", "MP-845", "decode",
                                "63 < AB 29 00 00 AB 29 00 00 AB 29 00 00 1E 0D > 52 < 0D")
        self.assertEqual(status, 0)
        self.assertIn("12 1E the angle: 30 degrees", lines(out))
        self.assertIn("< recalibrate: task complete", lines(out))

    def test_streamed_positions_come_before_the_cr(self):
        _, out, _ = decode("-c", "mpc", "-s", "MP-225", "decode",
                           "53 0F 10 00 00 00 00 00 00 00 00 00 00 00 < FF FF FF 10 00 00 0D 00 00 00 00 00 0D")
        self.assertIn("< at X 1.0 um (16 steps), Y 0.8125 um (13), Z 0.0 um (0)", lines(out))
        self.assertIn("< line: task complete", lines(out))

    def test_one_cr_answers_a_move_and_its_interrupt(self):
        _, out, _ = decode("-c", "mpc", "decode", "48 03 < 0D > 4B < 01 21 03 0D")
        self.assertIn("< interrupt: task complete", lines(out))
        self.assertIn("< drive 1 is active, firmware 3.21", lines(out))

    def test_what_is_no_command_and_what_is_missing(self):
        _, out, _ = decode("-c", "trio", "decode", "EE,0D,0x49 41")
        self.assertIn("> 0xEE is no command of the TRIO MP-245A with firmware 3.12", lines(out))
        self.assertIn("> between commands: means nothing", lines(out))
        self.assertIn("> angle: 1 byte of 2, the rest is missing", lines(out))
        _, out, _ = decode("-c", "trio", "decode", "< 0D")
        self.assertIn("< nothing has been asked for", lines(out))

    def test_what_is_wrong(self):
        status, _, err = decode("decode", "43")
        self.assertEqual(status, 2)
        self.assertIn("--controller trio or mpc", err)
        status, _, err = decode("-c", "mpc", "decode", "4 3")
        self.assertEqual(status, 2)
        self.assertIn("'4 ' is no byte", err)
        status, _, err = decode("decode", "/nowhere/to.be")
        self.assertEqual(status, 2)
        self.assertIn("neither hexadecimal bytes nor a file", err)


class Recordings(unittest.TestCase):
    def decode_text(self, text):
        with tempfile.NamedTemporaryFile("w", suffix=".rec") as file:
            file.write(text)
            file.flush()
            return decode("decode", file.name)

    def test_a_recording_says_itself_what_it_is_of(self):
        status, out, _ = self.decode_text(
            "dryrig-recording 1\nset mpc controller mpc\nset mpc firmware 3.21\nset mpc device MP-225\n"
            "set mpc device MP-845\n0.002340 0.002391 mpc > 49\n0.002350 0.002391 mpc > 02\n"
            "0.003512 0.003570 mpc < 02 0D\n0.010000 0.010000 mpc > 43\n"
            "0.012000 0.012000 mpc < 02 80 3E 00 00 00 00 00 00 00 00 00 00 0D\n"
            "0.500000 0.500061 mpc - the port has been opened\n")
        self.assertEqual(status, 0)
        got = lines(out)
        self.assertIn("0.002350 > make active drive 2", got)
        self.assertIn("0.012000 < drive 2: X 750.0 um (16,000 steps), Y 0.0 um (0), Z 0.0 um (0)", got)
        self.assertIn("0.500000 - the port has been opened", got)

    def test_a_torn_one_is_told_as_far_as_it_goes(self):
        status, out, err = self.decode_text(
            "dryrig-recording 1\nset t controller trio\n0.000000 0.000000 t > 63\n0.000000 0.0000")
        self.assertEqual(status, 2)
        self.assertIn("> tell position and angle", out)
        self.assertRegex(err, r"\.rec:4: the line is torn off")


if __name__ == "__main__":
    unittest.main()
