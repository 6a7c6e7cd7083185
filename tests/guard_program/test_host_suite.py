"""The end-to-end tests of the host library, through a guard that allows what they do. Left out is what the guard refuses by
design, or what is not about the line: angles of 0 and 90 degrees, a controller whose position has 13 bytes, ports and help; and
the examples, one of which counts streamed positions, of which a busy machine makes fewer, with a guard or without."""
import os
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
THROUGH = {
    "Commands": ["test_every_command_of_the_mpc", "test_every_command_of_the_trio", "test_refused_targets",
                 "test_options_before_and_after_the_command"],
    "Signals": ["test_sigint_stops_a_stream_and_says_where", "test_sigterm_stops_a_trio_line", "test_a_trio_move_runs_to_its_end",
                "test_progress_on_a_terminal"],
}


def wrapped(directory, name, *words):
    path = os.path.join(directory, name)
    with open(path, "w", encoding="ascii") as script:
        quoted = " ".join(f"'{word}'" for word in (sys.executable, os.path.join(HERE, "behind.py"), *words))
        script.write(f'#!/bin/sh\nexec {quoted} "$@"\n')
    os.chmod(path, 0o755)
    return path


def load_tests(loader, _tests, _pattern):
    directory = tempfile.mkdtemp(prefix="dryrig-")
    unittest.addModuleCleanup(__import__("shutil").rmtree, directory)
    os.environ["BEHIND"] = directory
    import test_host_programs as host  # pylint: disable=import-outside-toplevel
    host.DRYRIG = wrapped(directory, "dryrig", "arm", os.environ["DRYRIG"])
    host.run.__defaults__ = (None, host.DRYRIG)
    host.run.__kwdefaults__ = {"env": None, "program": host.DRYRIG}
    host.EMULATOR = wrapped(directory, "emu", "emu")
    suite = unittest.TestSuite()
    for group, names in THROUGH.items():
        for name in names:
            suite.addTests(loader.loadTestsFromName(f"test_host_programs.{group}.{name}"))
    return suite


if __name__ == "__main__":
    unittest.main()
