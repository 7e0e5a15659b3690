"""Records are data classes: compared, hashed, shown, copied and inherited as these are."""

import copy
import pickle
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import pytest

from composer.records import record


@record
class Point:
    x: int
    y: int = 0
    origin: str = field(default='', compare=False)
    note: str = field(default='', compare=False, repr=False)


@record
class Place:
    x: int
    y: int = 0


@record
class NamedPoint(Point):
    name: str = ''


@record
class Empty:
    pass


@record
class Circle:
    radius: float

    @cached_property
    def area(self):
        return 3 * self.radius**2


@dataclass(frozen=True)
class Same:
    """What `Point` is compared with."""

    x: int
    y: int = 0
    origin: str = field(default='', compare=False)
    note: str = field(default='', compare=False, repr=False)


VALUES = [(1,), (1, 2), (1, 2, 'a'), (1, 2, 'b', 'c'), (2, 1)]


@pytest.mark.parametrize('one', VALUES)
@pytest.mark.parametrize('other', VALUES)
def test_a_record_is_compared_hashed_and_shown_as_a_frozen_data_class_is(one, other):
    assert (Point(*one) == Point(*other)) == (Same(*one) == Same(*other))
    assert (hash(Point(*one)) == hash(Point(*other))) == (hash(Same(*one)) == hash(Same(*other)))
    assert repr(Point(*one)) == repr(Same(*one)).replace('Same', 'Point')


def test_records_of_two_classes_are_never_the_same():
    assert Point(1, 2) != Place(1, 2)
    assert Point(1, 2) != NamedPoint(1, 2)
    assert Empty() == Empty()
    assert len({Empty(), Empty(), Point(1), Point(1), NamedPoint(1)}) == 3


def test_a_record_can_be_replaced_copied_and_pickled():
    point = NamedPoint(1, 2, 'here', name='a')

    assert replace(point, x=3) == NamedPoint(3, 2, name='a')
    assert [each.name for each in fields(point)] == ['x', 'y', 'origin', 'note', 'name']
    for each in (copy.copy(point), copy.deepcopy(point), pickle.loads(pickle.dumps(point))):
        assert (each, each.origin) == (point, 'here')


def test_a_record_has_slots_unless_it_caches_a_property():
    circle = Circle(2.0)

    assert not hasattr(Point(1), '__dict__')
    assert circle.area == 12
    assert vars(circle) == {'radius': 2.0, 'area': 12}
    assert circle == Circle(2.0)
