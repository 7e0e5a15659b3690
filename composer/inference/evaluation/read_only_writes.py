"""Writes to messages that a subscription with `read_only: true` shares with others."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeGuard

from composer.inference.evaluation.part import Part
from composer.inference.message_types import item_of
from composer.inference.values import (
    Arguments,
    ArrayField,
    BoundMethod,
    Constant,
    Message,
    Sequence,
    Unknown,
    Value,
    alternatives,
    is_none,
)
from composer.python_source.changed_names import CHANGING

if TYPE_CHECKING:
    from composer.inference.values import Place

# Methods of lists, `array.array` and NumPy arrays that change what they are called on.
WRITING = CHANGING | {
    *('__delitem__', '__iadd__', '__imul__', '__setitem__', 'byteswap', 'fill', 'frombytes'),
    *('fromfile', 'fromlist', 'itemset', 'partition', 'put', 'resize', 'setfield'),
}
# Attributes of a NumPy array that are, or give, another array with the same memory.
VIEWING = frozenset(
    {
        *('T', 'diagonal', 'flat', 'imag', 'ravel', 'real', 'reshape', 'squeeze', 'swapaxes'),
        *('transpose', 'view'),
    }
)
# What numbers in messages are kept in has no view if it is a list.
_WITHOUT_VIEWS = ('bool', 'byte', 'string', 'wstring')
# Functions that write to an argument, by its position.
_WRITTEN = {
    **{f'builtins.list.{name}': 0 for name in CHANGING},
    **dict.fromkeys(('bisect.insort', 'bisect.insort_left', 'bisect.insort_right'), 0),
    **dict.fromkeys((f'heapq.heap{name}' for name in ('ify', 'pop', 'push', 'replace')), 0),
    **dict.fromkeys(('heapq.heappushpop', 'random.shuffle', 'builtins.object.__setattr__'), 0),
    **{f'operator.{name}': 0 for name in ('delitem', 'setitem')},
    **{
        f'operator.{name}': 0
        for name in ('iadd', 'iand', 'iconcat', 'ifloordiv', 'ilshift', 'imatmul', 'imod')
    },
    **{f'operator.{name}': 0 for name in ('imul', 'ior', 'ipow', 'irshift', 'isub', 'itruediv')},
    **{
        f'numpy.{name}': 0
        for name in ('copyto', 'fill_diagonal', 'place', 'put', 'put_along_axis', 'putmask')
    },
    'numpy.random.shuffle': 0,
    'struct.pack_into': 1,
    **{
        f'cv2.{name}': 0
        for name in (
            *('arrowedLine', 'circle', 'drawContours', 'drawMarker', 'ellipse', 'fillConvexPoly'),
            *('fillPoly', 'floodFill', 'line', 'polylines', 'putText', 'randn', 'randu'),
            *('rectangle', 'setIdentity'),
        )
    },
}
# The arguments into which functions of some libraries put their result.
_RESULTS = {'numpy.': 'out', 'cv2.': 'dst'}
_VIEW_MAKERS = frozenset(
    {
        'builtins.memoryview',
        *(
            f'numpy.{name}'
            for name in (
                *('asanyarray', 'asarray', 'ascontiguousarray', 'asfarray', 'asfortranarray'),
                *('atleast_1d', 'atleast_2d', 'atleast_3d', 'expand_dims', 'flip', 'fliplr'),
                *('flipud', 'frombuffer', 'moveaxis', 'ravel', 'reshape', 'rot90', 'squeeze'),
                *('swapaxes', 'transpose'),
            )
        ),
    }
)


class ReadOnlyWrites(Part):
    """Finds writes to messages that others have, too, and knows what shares their memory."""

    def check_write(self, owner: Value, place: Place) -> None:
        """Report a write to something, if it is sure to be part of such a message."""
        several = [each for each in alternatives(owner) if not is_none(each)]
        if not several or not all(map(_is_read_only, several)):
            return
        self._evaluator.run.report(
            'read-only-message',
            place,
            'this writes to a message that a read_only subscription shares with others',
            "write to a copy, as copy.deepcopy makes one, or remove 'read_only: true'",
            is_harm=True,
        )

    def check_method(self, owner: Value, name: str, place: Place) -> None:
        """Report a call of a method that changes its object."""
        if name in WRITING:
            self.check_write(owner, place)

    def check_call(self, name: str, arguments: Arguments, place: Place) -> None:
        """Report a call of a function that changes an argument."""
        position = _WRITTEN.get(name)
        if position is not None and (argument := arguments.get(position, '')) is not None:
            self.check_write(argument.value, place)
        for library, key in _RESULTS.items():
            result = dict(arguments.named).get(key) if name.startswith(library) else None
            if result is not None:
                self.check_write(result.value, result.place)

    def is_view(self, owner: Value, name: str) -> bool:
        """Return whether a method gives something with the memory of such a message."""
        return name in VIEWING and _is_read_only(owner)

    def gives_view(self, name: str, arguments: Arguments) -> bool:
        """Return whether a function gives something with the memory of such a message."""
        named = dict(arguments.named)
        if name == 'numpy.ndarray':
            given = arguments.get(2, 'buffer')
        elif name == 'numpy.array':
            copies = named['copy'].value if 'copy' in named else None
            is_copy = not isinstance(copies, Constant) or bool(copies.value)
            given = None if is_copy else arguments.get(0, '')
        else:
            given = arguments.get(0, '') if name in _VIEW_MAKERS else None
        if given is None:
            return False
        return all(_is_read_only(each) and _has_views(each) for each in alternatives(given.value))

    def copy_of(self, array: ArrayField, place: Place) -> Value:
        """Return a copy of an array: its messages are the same."""
        if array.is_read_only and array.type.nested:
            return Sequence([(item_of(array), place)], list, is_open=True)
        return replace(array, is_read_only=False)

    def slice_of(self, array: ArrayField, place: Place) -> Value:
        """Return a slice of an array: of a NumPy array, it is a view."""
        is_view = array.type.array == 'fixed' and _has_views(array)
        return array if is_view else self.copy_of(array, place)


def _is_read_only(value: Value) -> TypeGuard[Message | ArrayField | Unknown | BoundMethod]:
    if isinstance(value, BoundMethod):
        # What is read of an array, and not known: `.flat`.
        return value.name in VIEWING and _is_read_only(value.owner)
    return isinstance(value, Message | ArrayField | Unknown) and value.is_read_only


def _has_views(value: Value) -> bool:
    if not isinstance(value, ArrayField):
        return True
    return value.type.nested is None and value.type.kind not in _WITHOUT_VIEWS
