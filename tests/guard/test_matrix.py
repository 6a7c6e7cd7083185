#!/usr/bin/python3
"""docs/fault-matrix.md and the tests say the same: each row has a test or says why not, each test has its row, and what the
table names exists.

    test_matrix.py ROOT
"""
import re
import sys
import unittest
from pathlib import Path

ROOT = Path(sys.argv.pop(1))
LAST = 89


def tests_of_rows():
    rows = {}
    for path in (ROOT / 'tests/guard').glob('test_*.c'):
        for name in re.findall(r'RUN_TEST\((rows?_\w+)\)', path.read_text()):
            for number in re.match(r'rows?_((?:\d+_)+)', name).group(1).split('_')[:-1]:
                rows.setdefault(int(number), []).append(name)
    return rows


class Matrix(unittest.TestCase):
    def setUp(self):
        table = (ROOT / 'docs/fault-matrix.md').read_text()
        self.rows = {int(number): cells.split('|') for number, cells in re.findall(r'^\| (\d+) \|(.*)\|$', table, re.M)}

    def test_all_rows_are_there_in_order(self):
        self.assertEqual(list(self.rows), list(range(1, LAST + 1)))

    def test_each_row_has_a_test_or_says_why_not(self):
        tested = tests_of_rows()
        for number, cells in self.rows.items():
            with self.subTest(number):
                self.assertEqual(len(cells), 3)
                self.assertTrue(number in tested or cells[2].strip())
                self.assertFalse(number in tested and cells[2].strip() == '-')

    def test_each_test_has_its_row(self):
        self.assertLessEqual(set(tests_of_rows()), set(self.rows))

    def test_what_is_named_exists(self):
        parts = ('guard', 'guard_program', 'boards')
        text = ''.join(path.read_text() for part in parts for suffix in ('c', 'py')
                       for path in (ROOT / 'tests' / part).rglob(f'*.{suffix}') if path != Path(__file__))
        for number, cells in self.rows.items():
            for name in re.findall(r'`(\w+)`', cells[2]):
                self.assertTrue(re.search(rf'\b{name}\(', text), f'row {number}: there is no {name}')


if __name__ == '__main__':
    unittest.main()
