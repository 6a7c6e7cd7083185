"""The guard as the Pico's image in rp2040js, with USB on the host's side and a script for the controller: that the board's parts
are wired as they should. What the guard does with them is in test_bridge_avr.py and test_bridge_cortex_m.py; this one is slow.

    test_bridge_pico.py NODE RP2040JS ROM.bin IMAGE.bin DRYRIG_GUARD
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from images import point

NODE, RP2040JS, ROM, IMAGE, GUARD = (sys.argv.pop(1) for _ in range(5))
RUNNER = str(Path(__file__).with_name("pico") / "pico_board.mjs")
STOP, STOP_2, KEY, ARM = "6", "7", "8", "9"  # GP numbers
HERE = point(20000, 20000, 20000) + b"\x1e\r"
THERE = point(20256, 20003, 20013)
CONFIGURATION = """format = 1; revision = 7; profile = "trio-mp245a"; firmware = "3.12";
    external_switch5_on = true; external_switch6_on = false;
    drives = ({ number = 1; device = "MP-845"; microstep_um = 0.09375; max_move_um = 5000;
                box_um = { x = (100, 24900); y = (100, 24900); z = (100, 20000); }; });"""


def run(events, limits=True):
    """What is sent: (us, who, bytes or a record), who is "host", ">" (to the controller) or "#" (the log)."""
    with tempfile.TemporaryDirectory() as temporary:
        text, image = Path(temporary, "rig.conf"), Path(temporary, "rig.bin")
        text.write_text(CONFIGURATION)
        subprocess.run([GUARD, "compile", text, "-o", image], check=True, stdout=subprocess.PIPE)
        script = "".join(f"{us} {what if isinstance(what, str) else what.hex(' ')}\n" for us, what in events)
        done = subprocess.run([NODE, RUNNER, RP2040JS, ROM, IMAGE, *(["--limits", image] if limits else []), "--script"],
                              input=script, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=800)
    if done.returncode:
        raise AssertionError(done.stderr)
    said = [line.split() for line in done.stdout.splitlines()]
    return [(int(us), what[0] if what[0] in ">#" else "host", bytes.fromhex(what.lstrip(">#"))) for us, what in said]


def got(said, who, since=0):
    return b"".join(what for us, whose, what in said if whose == who and us >= since)


def device(said):
    return "device " + said.hex(" ")


class Pico(unittest.TestCase):
    def test_proof_a_query_a_move_a_stop_and_a_refusal(self):
        arm, move, stop = 1_060_000, 1_300_000, 1_330_000
        slow, outside = b"S\x00" + THERE, b"S\x0f" + point(20000, 20000, 500)
        said = run([
            (1, f"low {STOP} {STOP_2} {KEY}"), (1_010_000, device(HERE)),
            (1_030_000, b"c"), (1_033_000, device(HERE)),
            (arm, f"low {ARM}"), (arm + 16_000, device(HERE)), (arm + 120_000, device(HERE)), (arm + 140_000, f"open {ARM}"),
            (move - 60_000, outside), (move - 50_000, device(HERE)),
            (move, slow), (move + 8_000, device(HERE)),
            (stop, b"\x03"), (stop + 4_000, b"\x03"), (stop + 10_000, "stop")])
        self.assertEqual(got(said, ">", 0)[:1], b"c")
        self.assertGreaterEqual(next(us for us, who, _ in said if who == ">"), 1_000_000)
        self.assertEqual(got(said, "host"), HERE)  # and nothing for what was refused, nor yet for what was stopped
        self.assertEqual(got(said, ">", arm), b"cc" + b"c" + b"c" + slow + b"\x03\x03")
        sent = next(us for us, who, what in said if who == ">" and us >= stop)
        self.assertLessEqual(sent - stop, 1000 + 1000)  # USB looks every millisecond
        records = [what for _, who, what in said if who == "#"]
        self.assertEqual(int.from_bytes(records[0][36:40], "little"), 7)  # the revision
        self.assertEqual([record[8] for record in records].count(3), 1)  # refused

    def test_without_a_configuration_nothing_leaves(self):
        said = run([(1, f"low {STOP} {STOP_2} {KEY}"), (30_000, b"c\x03"), (1_100_000, "stop")], limits=False)
        self.assertEqual((got(said, ">"), got(said, "host")), (b"", b""))


if __name__ == "__main__":
    unittest.main()
