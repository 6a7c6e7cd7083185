"""The link of dryrig-emu: made and removed, replaced when it is its own stale one, and nobody else's ever touched."""
import os
import pty
import signal
import subprocess
import tempfile

import emu
from emu import ACTIVE, Emulator, Port, outcome


class Link(emu.InDirectory):
    def setUp(self):
        super().setUp()
        self.link = os.path.join(self.directory, "rig")

    def killed(self):
        """An emulator that has left its link. Whoever gets the number of its port from now on gets it later."""
        e = Emulator("mpc", "--link", self.link)
        self.answers()
        e.stop(signal.SIGKILL)

        def clock_has_gone_on():  # that of the file system, which ticks every few milliseconds
            with tempfile.NamedTemporaryFile(dir=self.directory) as file:
                return os.stat(file.name).st_mtime_ns > os.lstat(self.link).st_mtime_ns
        emu.wait_until(clock_has_gone_on, "a tick")
        return e

    def answers(self):
        with Port(self.link) as port:
            self.assertEqual(port.ask(b"K", 4), ACTIVE[1])

    def refused(self, *words):
        status, out, error = outcome("mpc", "--link", self.link)
        self.assertEqual((status, out), (1, ""))
        for word in words:
            self.assertIn(word, error)

    def test_is_there_before_ready_and_gone_at_the_end(self):
        with Emulator("mpc", "--link", self.link) as e:
            self.assertEqual(os.readlink(self.link), e.path)
            self.answers()
        self.assertEqual(os.listdir(self.directory), [])

    def test_a_relative_one_is_made_where_the_program_was_started(self):
        with Emulator("mpc", "--link", "rig", cwd=self.directory):
            self.answers()
        self.assertEqual(os.listdir(self.directory), [])

    def test_a_second_emulator_is_refused_and_the_first_goes_on(self):
        with Emulator("mpc", "--link", self.link):
            self.refused(self.link, "in use")
            self.answers()
            os.chmod(self.link, 0o666)  # makes the port look new
            for self.link in (self.link, os.path.join(self.directory, "..", os.path.basename(self.directory), "rig")):
                self.refused(self.link, "in use")
                self.answers()

    def test_of_many_that_start_at_once_one_gets_it(self):
        for stale in (False, True):
            if stale:
                self.killed()
                self.assertTrue(os.path.islink(self.link))
            started = [emu.start("mpc", "--link", self.link) for _ in range(8)]
            lines = [process.stdout.readline() for process in started]
            winners = [process for process, line in zip(started, lines) if line]
            self.assertEqual(len(winners), 1)
            self.answers()
            winners[0].terminate()
            statuses = []
            for process in started:
                process.communicate(timeout=emu.LIMIT_S)
                statuses.append(process.returncode)
            self.assertEqual(sorted(statuses), [0] + [1] * 7)
            self.assertEqual(os.listdir(self.directory), [])

    def test_what_kill_9_leaves_is_replaced(self):
        for _ in range(3):
            self.killed()
            self.assertEqual(os.listdir(self.directory), ["rig"])
        with Emulator("mpc", "--link", self.link):
            self.answers()
        self.assertEqual(os.listdir(self.directory), [])

    def test_what_kill_9_leaves_is_replaced_though_its_number_was_given_away(self):
        e = self.killed()
        ends = []  # somebody else gets the number: we, or another test
        while not os.path.exists(e.path):
            ends += pty.openpty()
        is_ours = e.path in map(os.ttyname, ends[1::2])
        try:
            with Emulator("mpc", "--link", self.link) as again:
                self.assertFalse(is_ours and again.path == e.path)
                self.answers()
        finally:
            for end in ends:
                os.close(end)

    def test_what_kill_9_leaves_is_replaced_though_another_emulator_has_its_number(self):
        e = self.killed()
        others = []
        while not os.path.exists(e.path):
            others.append(Emulator("trio", "--link", f"{self.link}{len(others)}"))
        with Emulator("mpc", "--link", self.link):
            self.answers()
        for other in others:
            self.assertEqual(other.stop(), 0)

    def test_a_file_stays(self):
        with open(self.link, "w", encoding="ascii") as file:
            file.write("precious")
        self.refused(self.link, "file")
        with open(self.link, encoding="ascii") as file:
            self.assertEqual(file.read(), "precious")

    def test_a_directory_stays(self):
        os.mkdir(self.link)
        self.refused(self.link, "directory")
        self.assertTrue(os.path.isdir(self.link))

    def test_somebodys_link_stays_even_if_it_leads_nowhere(self):
        for target in ("/nowhere", "/dev/null", "/dev/pts/", "/dev/pts/1x", "/dev/ttyUSB0"):
            os.symlink(target, self.link)
            self.refused(self.link, target)
            self.assertEqual(os.readlink(self.link), target)
            os.remove(self.link)

    def test_somebodys_link_to_a_living_terminal_stays(self):
        ends = pty.openpty()
        os.symlink(os.ttyname(ends[1]), self.link)
        self.refused(self.link, "somebody uses")
        self.assertEqual(os.readlink(self.link), os.ttyname(ends[1]))
        for end in ends:
            os.close(end)

    def test_at_the_end_somebodys_link_in_its_place_stays(self):
        with Emulator("mpc", "--link", self.link):
            os.remove(self.link)
            os.symlink("/nowhere", self.link)
        self.assertEqual(os.readlink(self.link), "/nowhere")

    def test_a_directory_that_is_not_there(self):
        self.link = os.path.join(self.directory, "no", "rig")
        self.refused(self.link, "No such file")

    def test_a_failed_start_leaves_nothing(self):
        status, out, error = outcome("mpc", "--link", self.link, "--trace", os.path.join(self.directory, "no", "trace"))
        self.assertEqual((status, out), (1, ""))
        self.assertIn("trace", error)
        self.assertEqual(os.listdir(self.directory), [])

    def test_no_descriptor_to_be_had_is_said(self):
        for most in range(5, 9):
            command = f'ulimit -n {most}; exec "{emu.PROGRAM}" mpc --link {self.link}'
            done = subprocess.run(["bash", "-c", command], capture_output=True, check=False, timeout=emu.LIMIT_S)
            self.assertEqual(done.returncode, 1, (most, done))
            self.assertIn(b"Too many open files", done.stderr)
            self.assertEqual(done.stdout, b"")
            self.assertEqual(os.listdir(self.directory), [])


if __name__ == "__main__":
    emu.main()
