"""Compares messages with what is expected of them, field by field.

Two numbers are the same if they differ by no more than the tolerance, absolutely or as a part of
the expected number, whichever is more: `|actual - expected| <= tolerance * max(1, |expected|)`.
In fields of 32-bit floats, both are rounded to 32 bits before. A NaN is the same as a NaN, and an
infinite number as itself alone.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any

from composer.records import record
from composer.scenarios.fields import is_message

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.yaml_text.positions import DataPath

_FLOAT32 = 'float'


@record
class Difference:
    """A place where a message is not as expected.

    Attributes:
        path: The fields and indices that lead there.
        expected: A value; or a text in words, if `is_note`.
        actual: As `expected`.
        is_note: Whether these are words, such as `3 items`.
    """

    path: DataPath
    expected: Any
    actual: Any
    is_note: bool = False


def find_distance(differences: Sequence[Difference]) -> tuple[float, int]:
    """Return what is least for the nearest values: how far all are off, then how many are.

    A number counts as less than 1, the more the farther it is off; anything else counts as 1.
    """
    return sum(map(_distance, differences)), len(differences)


def _distance(difference: Difference) -> float:
    expected, actual = difference.expected, difference.actual
    if not (_is_number(expected) and _is_number(actual)):
        return 1.0
    off = abs(actual - expected) / max(1.0, abs(expected))
    return off / (1.0 + off) if math.isfinite(off) else 1.0


@record
class Comparison:
    """How values are compared.

    Attributes:
        tolerance: How far numbers may be off.
        ignored: Fields that are not compared, without the indices of arrays.
    """

    tolerance: float = 0.0
    ignored: frozenset[tuple[str, ...]] = field(default=frozenset())

    def find_differences(self, expected: Any, actual: Any) -> Iterator[Difference]:
        """Yield where a value is not as expected.

        Args:
            expected: Plain data, in which fields may be left out; or a whole message.
            actual: A message, or plain data.
        """
        return self._compare(expected, actual, (), '')

    def _compare(
        self, expected: Any, actual: Any, path: DataPath, type_name: str
    ) -> Iterator[Difference]:
        if self.ignored and tuple(each for each in path if isinstance(each, str)) in self.ignored:
            return
        if is_message(expected):
            yield from self._compare_messages(expected, actual, path)
        elif is_message(actual):
            yield from self._compare_fields(expected, actual, path)
        elif isinstance(expected, Mapping):
            yield from self._compare_mappings(expected, actual, path)
        elif _is_array(expected) or _is_array(actual):
            yield from self._compare_arrays(expected, actual, path, item_type(type_name))
        elif not self._is_same(expected, actual, is_narrow=type_name == _FLOAT32):
            if type_name == _FLOAT32:
                expected, actual = _narrow(expected), _narrow(actual)
            yield Difference(path, expected, actual)

    def _compare_messages(
        self, expected: Any, actual: Any, path: DataPath
    ) -> Iterator[Difference]:
        fields: dict[str, str] = expected.get_fields_and_field_types()
        if not is_message(actual) or fields != actual.get_fields_and_field_types():
            names = type(expected).__name__, type(actual).__name__
            yield Difference(path, *names, is_note=True)
            return
        for name, type_name in fields.items():
            values = getattr(expected, name), getattr(actual, name)
            yield from self._compare(*values, (*path, name), type_name)

    def _compare_fields(self, expected: Any, actual: Any, path: DataPath) -> Iterator[Difference]:
        fields: dict[str, str] = actual.get_fields_and_field_types()
        if not isinstance(expected, Mapping) and len(fields) == 1:
            # A message with one field may be written as that.
            expected = dict.fromkeys(fields, expected)
        if not isinstance(expected, Mapping):
            yield Difference(path, expected, actual)
            return
        for name, value in expected.items():
            at = (*path, name)
            if name not in fields:
                yield Difference(at, 'a field', 'no such field', is_note=True)
            else:
                yield from self._compare(value, getattr(actual, name), at, fields[name])

    def _compare_mappings(
        self, expected: Mapping[str, Any], actual: Any, path: DataPath
    ) -> Iterator[Difference]:
        if not isinstance(actual, Mapping):
            yield Difference(path, expected, actual)
            return
        for key, value in expected.items():
            at = (*path, key)
            if key not in actual:
                yield Difference(at, value, 'nothing', is_note=True)
            else:
                yield from self._compare(value, actual[key], at, '')

    def _compare_arrays(
        self, expected: Any, actual: Any, path: DataPath, type_name: str
    ) -> Iterator[Difference]:
        if not (_is_array(expected) and _is_array(actual)):
            yield Difference(path, expected, actual)
            return
        wanted, found = _items(expected), _items(actual)
        if wanted == found:
            return
        if len(wanted) != len(found):
            yield Difference(path, _count(wanted), _count(found), is_note=True)
        for index, (one, other) in enumerate(zip(wanted, found, strict=False)):
            yield from self._compare(one, other, (*path, index), type_name)

    def _is_same(self, expected: Any, actual: Any, *, is_narrow: bool) -> bool:
        if not (_is_number(expected) and _is_number(actual)):
            return _is_same_scalar(expected, actual)
        if is_narrow:
            expected, actual = _to_float32(expected), _to_float32(actual)
        if expected == actual:
            return True
        if math.isnan(expected) or math.isnan(actual):
            return math.isnan(expected) and math.isnan(actual)
        if math.isinf(expected) or math.isinf(actual):
            return False
        return bool(abs(actual - expected) <= self.tolerance * max(1.0, abs(expected)))


def _is_same_scalar(expected: Any, actual: Any) -> bool:
    """Return whether values are the same, of which one at least is no number."""
    if isinstance(actual, bytes) and len(actual) == 1 and _is_number(expected):
        # A field of the type `byte`.
        return bool(actual[0] == expected)
    if isinstance(expected, bytes) and len(expected) == 1 and _is_number(actual):
        return bool(expected[0] == actual)
    return type(expected) is type(actual) and bool(expected == actual)


def _narrow(value: Any) -> Any:
    """Return a number of 32 bits with no more digits than it needs: 0.2, not 0.200000003."""
    if not isinstance(value, float) or not math.isfinite(value):
        return value
    rounded = _to_float32(value)
    near = (float(f'{rounded:.{digits}g}') for digits in range(1, 9))
    return next((each for each in near if _to_float32(each) == rounded), rounded)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_array(value: Any) -> bool:
    is_text = isinstance(value, str | bytes)
    return not is_text and (isinstance(value, Sequence) or hasattr(value, 'tolist'))


def _items(array: Any) -> list[Any]:
    return array.tolist() if hasattr(array, 'tolist') else list(array)


def _count(items: list[Any]) -> str:
    return '1 item' if len(items) == 1 else f'{len(items)} items'


def item_type(type_name: str) -> str:
    """Return the type of the items of an array, as `get_fields_and_field_types` names both."""
    if type_name.startswith('sequence<'):
        return type_name.removeprefix('sequence<').removesuffix('>').partition(',')[0]
    return type_name.partition('[')[0]


def _to_float32(value: float) -> float:
    """Return the nearest number that a `float32` holds; infinity if it is too large."""
    return array('f', (value,))[0]
