"""Which edits of a module change the class of a behaviour."""

import ast

import pytest

from composer.planning.snapshot_taking import find_class_code

SOURCE = """
import math
from parts import Part

LIMIT = math.pi / 2
COUNTS = {}


def clip(value):
    return min(value, LIMIT)


def other(node):
    COUNTS['other'] = 1
    return 'one'


class Base:
    part = Part


class Counter(Base):
    def tick(self, node):
        return clip(1)
"""


def code_of(source):
    found = find_class_code(source, 'Counter')
    return None if found is None else [ast.dump(each) for each in found]


@pytest.mark.parametrize(
    ('old', 'new', 'is_same'),
    [
        ("'one'", "'two'", True),
        ('def other', '# a remark\n\n\ndef another', True),
        ('COUNTS = {}', 'COUNTS = {}\nMORE = []', True),
        ('clip(1)', 'clip(2)', False),
        ('/ 2', '/ 3', False),
        ('part = Part', 'part = None', False),
        ('min(', 'max(', False),
        ('from parts', 'from others', False),
        ('class Base:', 'class Base:\n    more = 1\n', False),
    ],
)
def test_a_class_is_the_same_if_all_that_it_uses_is(old, new, is_same):
    assert old in SOURCE
    assert (code_of(SOURCE) == code_of(SOURCE.replace(old, new))) is is_same


@pytest.mark.parametrize(
    'more',
    [
        'Counter.limit = 3',
        'def count():\n    return Counter',
        'def change():\n    global LIMIT\n    LIMIT = 3',
        'LIMIT = [3]',
        'print(clip)',
        'from more import *',
        'def see():\n    return globals()',
        'this is no Python',
    ],
)
def test_what_may_be_shared_with_the_rest_cannot_be_told(more):
    assert code_of(SOURCE) is not None
    assert code_of(f'{SOURCE}\n{more}\n') is None
