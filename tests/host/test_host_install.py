"""What `cmake --install` leaves: another project uses it in three lines, by CMake and by pkg-config; static, shared."""
import os
import shutil
import subprocess
import tempfile
import unittest

SOURCE = os.environ["DRYRIG_SOURCE"]
CONSUMER = os.environ["DRYRIG_CONSUMER"]

CMAKE = """cmake_minimum_required(VERSION 3.20)
project(consumer C)
find_package(dryrig REQUIRED)
add_executable(consumer consumer.c)
target_link_libraries(consumer dryrig::dryrig)
"""


def sh(*args, **options):
    done = subprocess.run(args, capture_output=True, text=True, timeout=1200, **options)
    if done.returncode != 0:
        raise AssertionError(f"{args}: {done.stdout}{done.stderr}")
    return done.stdout


class Install(unittest.TestCase):
    def check(self, shared):
        with tempfile.TemporaryDirectory() as folder:
            build, prefix, project = f"{folder}/build", f"{folder}/prefix", f"{folder}/project"
            sh("cmake", "-S", SOURCE, "-B", build, "-G", "Ninja", "-DDRYRIG_TESTS=OFF", f"-DBUILD_SHARED_LIBS={shared}")
            sh("nice", "ninja", "-C", build)
            sh("cmake", "--install", build, "--prefix", prefix)
            moved = f"{folder}/elsewhere"  # the installed tree may be moved
            os.rename(prefix, moved)
            files = {os.path.relpath(os.path.join(at, name), moved)
                     for at, _, names in os.walk(moved) for name in names}
            for name in ("bin/dryrig", "include/dryrig/dryrig.h", "share/man/man1/dryrig.1", "share/man/man3/dryrig.3"):
                self.assertIn(name, files)
            self.assertEqual(["dryrig.h"], sorted(os.path.basename(name) for name in files if name.endswith(".h")))
            library = next(os.path.dirname(name) for name in files if os.path.basename(name).startswith("libdryrig."))
            env = {**os.environ, "LD_LIBRARY_PATH": f"{moved}/{library}",
                   "PKG_CONFIG_PATH": f"{moved}/{library}/pkgconfig"}
            self.assertRegex(sh(f"{moved}/bin/dryrig", "--version", env=env), "^dryrig ")

            os.mkdir(project)
            with open(f"{project}/CMakeLists.txt", "w", encoding="ascii") as file:
                file.write(CMAKE)
            shutil.copy(CONSUMER, f"{project}/consumer.c")
            sh("cmake", "-S", project, "-B", f"{project}/build", f"-DCMAKE_PREFIX_PATH={moved}")
            sh("cmake", "--build", f"{project}/build")
            self.assertEqual("no-port\n", sh(f"{project}/build/consumer", env=env))

            flags = sh("pkg-config", "--cflags", "--libs", "dryrig", env=env).split()
            sh("cc", f"{project}/consumer.c", *flags, "-o", f"{project}/consumer")
            self.assertEqual("no-port\n", sh(f"{project}/consumer", env=env))
            if shared == "ON":
                exported = sh("nm", "-D", "--defined-only", f"{moved}/{library}/libdryrig.so")
                names = [line.split()[-1] for line in exported.splitlines()]
                self.assertTrue(names and all(name.startswith("dryrig_") for name in names), names)

    def test_static(self):
        self.check("OFF")

    def test_shared(self):
        self.check("ON")


if __name__ == "__main__":
    unittest.main()
