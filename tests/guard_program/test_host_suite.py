"""The end-to-end tests of the host library, through a guard that allows what they do: all of them but those below."""
import os
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
LEFT_OUT = {
    # Refused by design:
    "Commands.test_old_firmware_and_an_empty_controller":
        "without a manipulator an MPC-200 cannot prove who it is (test_bridge.py has the old firmware, and the empty one)",
    "Commands.test_observed_quirks": "a controller whose position has 13 bytes is not taken",
    # Not about what goes over the line:
    "Usage.test_errors_say_what_and_where": "no port is opened",
    "Usage.test_help_and_version": "no port is opened",
    "Ports.test_a_missing_port_lists_those_that_there_are": "no port is opened",
    "Ports.test_a_busy_port_names_who_has_it": "behind.py arms when the port is free; here it is not to be",
    "Ports.test_a_link_and_a_port_that_ends": "the link is the emulator's, which is another port here",
    "Ports.test_libserialport_end_to_end": "the guard's port is a pseudo-terminal, which the shim would not find",
    "Examples.test_each": "one counts streamed positions, of which a busy machine makes fewer, with a guard or without",
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
    suite, left_out = unittest.TestSuite(), set()
    for group in vars(host).values():
        if not (isinstance(group, type) and issubclass(group, unittest.TestCase)):
            continue
        for name in loader.getTestCaseNames(group):
            if f"{group.__name__}.{name}" in LEFT_OUT:
                left_out.add(f"{group.__name__}.{name}")
            else:
                suite.addTest(group(name))
    assert left_out == set(LEFT_OUT), f"there is no {set(LEFT_OUT) - left_out} any more"
    assert suite.countTestCases() >= 8
    return suite


if __name__ == "__main__":
    unittest.main()
