"""A check that cannot fail checks nothing: puts one violation of each kind into a copy of a part of the
core and sees it caught.

    test_core_rules.py DIRECTORY    (of the core)
"""
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

CHECK = Path(__file__).with_name("core_rules.py")
CORE = Path(sys.argv.pop(1))


class CoreRules(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.core = Path(temporary.name)
        for name in ("dr_device", "dr_wire", "dr_motion"): # a small core that stands by itself
            for suffix in (".c", ".h"):
                shutil.copy(CORE / (name + suffix), self.core)
        shutil.copy(CORE / "CMakeLists.txt", self.core)

    def check(self):
        return subprocess.run([sys.executable, CHECK, self.core], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def add(self, text, name="dr_motion.c"):
        with open(self.core / name, "a") as file:
            file.write("\n" + text + "\n")

    def caught(self, rule, text, name="dr_motion.c"):
        """Added to that file, the text is a violation of that rule and of no other."""
        with self.subTest(text):
            before = (self.core / name).read_text()
            self.add(text, name)
            done = self.check()
            (self.core / name).write_text(before)
            self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
            for line in done.stdout.splitlines():
                self.assertRegex(line, rf"/{name}(:\d+)?: {rule}: ")

    def passes(self, text):
        with self.subTest(text):
            before = (self.core / "dr_motion.c").read_text()
            self.add(text)
            done = self.check()
            (self.core / "dr_motion.c").write_text(before)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))

    def test_the_copy_as_it_is(self):
        done = self.check()
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))

    def test_words(self):
        for text in ("/* float */", "typedef int my_float;", "typedef int Double2;", "/* malloc(), then free() */",
                     '#define DR_TEXT "printf"', "/* errno */"):
            self.caught("word", text)
        self.passes("/* floating doubles freely, reprinted */")

    def test_numbers(self):
        for text in ("#define DR_HALF 0.5", "#define DR_MANY 1e6", "#define DR_LITTLE .5"):
            self.caught("number", text)
        self.passes("#define DR_BYTE 0x1E5u /* 0.5 um */")

    def test_per_target_code(self):
        for text in ("#ifdef __AVR\n#endif", "#if defined(__linux__)\n#endif", "#ifndef ARDUINO\n#endif", "#pragma once",
                     "#ifdef DR_A\n#elif 1\n#endif"):
            self.caught("target", text)
        self.passes("#ifdef DR_BUILD_HAS_IT\n#endif")

    def test_includes(self):
        for text in ("#include <time.h>", "#include <sys/types.h>"):
            self.caught("include", text, "dr_motion.h")
            self.caught("include", text)
        self.passes("#include <string.h>")

    def test_layers(self):
        self.caught("layer", '#include "dr_wire.h"')
        self.caught("layer", "int dr_wire_axis(int);\nint dr_more(void);\nint dr_more(void) { return dr_wire_axis(1); }")
        self.passes("int dr_angle_test(void);\nint dr_angle_test(void) { dr_stage s; return dr_stage_get(DR_STAGE_NONE, &s); }")
        (self.core / "dr_more.c").write_text('#include "dr_device.h"\n')
        self.assertIn("dr_more.c:1: layer: ", self.check().stdout)

    def test_rooms(self):
        with open(self.core / "CMakeLists.txt", "a") as file:
            file.write("dr_core_module(dr_house dr_device ROOMS dr_house_low dr_house_high)\n")
        for name, text in (("dr_house.h", '#include "dr_device.h"\nint dr_house(void);\n'),
                           ("dr_house_rooms.h", '#include "dr_house.h"\nint dr_low(void);\nint dr_high(void);\n'),
                           ("dr_house_low.c", '#include "dr_house_rooms.h"\nint dr_low(void) { return 1; }\n'),
                           ("dr_house_high.c", '#include "dr_house_rooms.h"\nint dr_high(void) { return dr_low(); }\n'),
                           ("dr_house.c", '#include "dr_house_rooms.h"\nint dr_house(void) { return dr_high(); }\n')):
            (self.core / name).write_text(text)
        self.test_the_copy_as_it_is()
        self.caught("layer", "int dr_up(void);\nint dr_up(void) { return dr_high(); }", "dr_house_low.c")
        self.caught("layer", "int dr_top(void);\nint dr_top(void) { return dr_house(); }", "dr_house_high.c")
        self.caught("layer", '#include "dr_wire.h"', "dr_house_low.c")
        self.caught("layer", '#include "dr_house_rooms.h"')

    def test_loops(self):
        for head in ("while (1)", "for (;;)", "while (true)", "for (int i = 0;; i++)", "while (n > 0)", "for (; n; n = n / 2)"):
            self.caught("loop", f"int dr_loop(int n);\nint dr_loop(int n) {{ {head} {{ n--; }} return n; }}")
        self.caught("loop", "int dr_loop(int n);\nint dr_loop(int n) { do { n--; } while (n); return n; }")
        self.caught("loop", "int dr_loop(int n);\nint dr_loop(int n) { while (1) { n--; } /* at most n times */ return n; }")
        self.caught("word", "int dr_loop(int n);\nint dr_loop(int n) { again: if (n--) goto again; return n; }")
        self.passes("int dr_loop(int n);\nint dr_loop(int n) { while (n > 0) { n--; } /* at most n times */ return n; }")

    def test_recursion(self):
        self.caught("recursion", "int dr_down(int n);\nint dr_down(int n) { return n ? dr_down(n - 1) : 0; }")
        self.caught("recursion", "static int ping(int n);\nstatic int pong(int n) { return ping(n); }\n"
                                 "static int ping(int n) { return n ? pong(n - 1) : 0; }\n"
                                 "int dr_down(int n);\nint dr_down(int n) { return ping(n); }")

    def test_calls_through_pointers(self):
        self.caught("call", "int dr_call(int (*f)(void));\nint dr_call(int (*f)(void)) { return f(); }")

    def test_memory_of_its_own(self):
        self.caught("memory", "int dr_count;")
        self.caught("memory", "int dr_next(void);\nint dr_next(void) { static int n = 7; return n++; }")
        self.passes("int dr_third(int n);\nint dr_third(int n) { static const int t[] = {1, 2, 3}; return t[n]; }")

    def test_names(self):
        self.caught("name", "int helper(void);\nint helper(void) { return 1; }")

    def test_symbols(self):
        self.caught("symbol", "long write(int, const void *, unsigned long);\nint dr_say(void);\n"
                              "int dr_say(void) { return (int)write(1, \"\", 0); }")

    def test_what_cannot_be_compiled_is_no_pass(self):
        self.add("this is not C")
        done = self.check()
        self.assertEqual(done.returncode, 2)
        self.assertIn("cannot check", done.stderr)

    def test_floating_point_without_the_word(self):
        self.add("typedef __typeof__(1 / 2.5L) dr_t;")
        self.assertNotEqual(self.check().returncode, 0)

    def test_an_empty_directory_is_no_pass(self):
        for path in self.core.glob("*.c"):
            path.unlink()
        self.assertEqual(self.check().returncode, 2)


if __name__ == "__main__":
    unittest.main()
