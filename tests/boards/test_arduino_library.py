"""The Arduino library: made by the script, its example compiled as the Arduino IDE does it for an Uno, and run.

    test_arduino_library.py SOURCE AVR_BOARD
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import images
from images import between, point

SOURCE, RUNNER = (Path(sys.argv.pop(1)) for _ in range(2))
CORE = Path("/usr/share/arduino/hardware/arduino/avr")
FLAGS = """-Os -w -ffunction-sections -fdata-sections -flto -mmcu=atmega328p -DF_CPU=16000000L -DARDUINO=10819 -DARDUINO_AVR_UNO
    -DARDUINO_ARCH_AVR""".split()
CPP = "-std=gnu++11 -fpermissive -fno-exceptions -fno-threadsafe-statics -DDECIMAL_DIG=__DECIMAL_DIG__".split()


def run(*command):
    done = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        raise AssertionError(done.stdout)


class Library(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.directory = Path(temporary.name)
        run(SOURCE / "scripts/arduino-library", self.directory)
        self.library = self.directory / "Dryrig"

    def compiled(self, sketch):
        """The image of a sketch with the library."""
        include = [f"-I{path}" for path in (CORE / "cores/arduino", CORE / "variants/standard", self.library / "src")]
        objects = []
        sources = [*(CORE / "cores/arduino").glob("*.c*"), *(self.library / "src").glob("*.c*")]
        for source in sources:
            objects.append(self.directory / (source.name + ".o"))
            tool = ["avr-g++", *CPP] if source.suffix == ".cpp" else ["avr-gcc", "-std=gnu11"]
            run(*tool, *FLAGS, *include, "-c", source, "-o", objects[-1])
        run("avr-gcc", *FLAGS, "-c", CORE / "cores/arduino/wiring_pulse.S", "-o", self.directory / "wiring_pulse.o")
        run("avr-g++", *CPP, *FLAGS, *include, "-include", "Arduino.h", "-x", "c++", "-c", sketch, "-o", self.directory / "sketch.o")
        image = self.directory / "sketch.elf"
        run("avr-gcc", *FLAGS, "-fuse-linker-plugin", "-Wl,--gc-sections", self.directory / "sketch.o", *objects,
            self.directory / "wiring_pulse.o", "-lm", "-o", image)
        return image

    def test_the_example_is_a_trio(self):
        image = self.compiled(self.library / "examples/Emulator/Emulator.ino")
        events = [(1_500_000, b"c"), (1_600_000, b"x\0\0\0\0"), (1_900_000, b"c"), (2_000_000, "stop")]
        sent = images.run([str(RUNNER), "--script", "-", "atmega328p", str(image)], events)
        self.assertEqual(between(sent, 1_500_000, 1_600_000), point(10667, 10667, 10667) + b"\x1e\r")
        self.assertEqual(between(sent, 1_600_000, 2_000_000), b"\r" + point(0, 10667, 10667) + b"\x1e\r")

    def test_the_example_with_hands_has_buttons_and_a_knob(self):
        image = self.compiled(self.library / "examples/Hands/Hands.ino")
        events = [(2_500_000, "low C0"), (2_504_000, "low C1"), (2_508_000, "open C0"), (2_512_000, "open C1"),  # knob X on A0, A1
                  (2_600_000, b"c"), (2_700_000, "low D6"), (2_800_000, "open D6"), (3_600_000, b"c"), (3_650_000, "stop")]  # HOME
        pins = []
        sent = images.run([str(RUNNER), "--watch", "B5", "--script", "-", "atmega328p", str(image)], events, pins)
        self.assertEqual(between(sent, 2_500_000, 3_000_000), point(10667 + 64, 10667, 10667) + b"\x1e\r")
        self.assertEqual(between(sent, 3_000_000, 3_650_000), point(0, 0, 0) + b"\x1e\r")
        self.assertEqual([level for us, _, level in pins if us > 2_600_000], [1, 0])  # the LED while it moves

    def test_an_example_without_hands_does_not_pay_for_them(self):
        plain, hands = (self.compiled(self.library / f"examples/{name}/{name}.ino").stat().st_size for name in ("Emulator", "Hands"))
        self.assertLess(plain + 5000, hands)

    def test_it_has_what_the_ide_asks_for(self):
        properties = dict(line.split("=", 1) for line in (self.library / "library.properties").read_text().splitlines())
        for name in "name version author maintainer sentence paragraph category architectures".split():
            self.assertTrue(properties[name], name)
        self.assertRegex(properties["version"], r"^\d+\.\d+\.\d+$")

    def test_it_overwrites_nothing(self):
        with self.assertRaisesRegex(AssertionError, "is there already"):
            run(SOURCE / "scripts/arduino-library", self.directory)


if __name__ == "__main__":
    unittest.main()
