#!/usr/bin/python3
"""The model against examples that were worked out on paper."""
import unittest

from model import Controller, Drive, diagonal

TRIO, MPC = True, False


def run(controller, *pushes):
    """The bytes and their instants on a line that takes no time; pushes are (instant, bytes)."""
    got = []
    for at, data in list(pushes) + [(None, b'')]:
        while True:
            due = controller.due()
            if due is None or (at is not None and due > at):
                break
            got += [(due, byte) for byte in controller.pull(due, 10000)]
        if at is not None:
            controller.push(at, data)
            got += [(at, byte) for byte in controller.pull(at, 10000)]
    return got


def mpc(*position, firmware=0x321, quirks=0, **drive):
    return Controller(MPC, firmware, [Drive('MPC_MP225', position, **drive)], quirks)


def trio(*position, angle=30, **more):
    return Controller(TRIO, 0x312, [Drive('TRIO_MP285', position)], angle=angle, **more)


def point(*steps):
    return b''.join(s.to_bytes(4, 'little') for s in steps)


class OnPaper(unittest.TestCase):
    def test_diagonals_are_those_that_the_protocol_prints(self):
        less = [(25466, 20622), (26842, 18795), (28660, 15886), (29197, 14876), (30592, 11743), (31795, 7927),
                (32166, 6252), (32524, 3993)]
        more = [(6252, 32166), (7927, 31795), (11743, 30592), (14876, 29197), (15886, 28660), (18795, 26842),
                (20622, 25466)]
        self.assertEqual(more + [(23170, 23170)] + less, [diagonal(value) for value in range(16)])

    def test_a_move_of_a_millimetre(self):
        self.assertEqual([(333339, 13)], run(mpc(0, 0, 0), (5, b'M' + point(16000, 8000, 0))))

    def test_mpc_home_runs_along_the_diagonal(self):
        # 16,000 * 15,886 / 28,660 = 8,868.7: leg 1 ends at 0, 3200, 7132 after 1,000 um, leg 2 takes Z 445.75 um
        c = mpc(16000, 3200, 16000)
        self.assertEqual([(333334 + 148584, 13)], run(c, (0, b'H')))
        self.assertEqual([0, 0, 0], c.drive.position)

    def test_mpc_work_retraces_home(self):
        c = mpc(0, 0, 0, work=(16000, 3200, 16000))
        self.assertEqual([(0, 13), (1 + 148584 + 333334, 13)], run(c, (0, b'H'), (1, b'Y')))
        self.assertEqual([16000, 3200, 16000], c.drive.position)

    def test_trio_home_order(self):
        for angle, legs in ((30, (600000, 200000, 400000)), (60, (200000, 600000, 400000)), (45, (600000, 400000))):
            c = trio(8000, 16000, 24000, angle=angle)
            self.assertEqual([(sum(legs), 13)], run(c, (0, b'h')))
            self.assertEqual([0, 0, 0], c.drive.position)

    def test_a_streamed_micron(self):
        frame = b'\xff\xff\xff\x10\x00\x00\x00\x00\x00\x00\x00\x00'
        c = mpc(0, 0, 0)
        self.assertEqual([(0, 13)] + [(771, byte) for byte in frame] + [(771, 13)],
                         run(c, (0, b'O'), (1, b'S\x0f' + point(16, 0, 0))))

    def test_calibration_goes_beyond_zero_and_back(self):
        self.assertEqual([(2 * 83334, 13)], run(mpc(0, 0, 0), (0, b'N')))

    def test_recalibration_ends_at_a_millimetre(self):
        c = trio(8000, 8000, 8000)
        self.assertEqual([(4 * 200000, 13)], run(c, (0, b'R')))
        self.assertEqual([8000, 8000, 8000], c.drive.position)

    def test_interrupt_half_way(self):
        c = mpc(0, 0, 0)
        self.assertEqual([(166667, 13)], run(c, (0, b'M' + point(16000, 0, 0)), (166667, b'\x03')))
        self.assertEqual([16000 * 166667 // 333334, 0, 0], c.drive.position)


if __name__ == '__main__':
    unittest.main()
