"""NumPy arrays, as payloads and in messages with fixed arrays of numbers.

This module is apart from `arrays`, because NumPy is imported only where it is used.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from composer.interfaces.descriptions import FieldType
from composer.interfaces.field_values import INTEGER_RANGES, Reader, check_length


def fixed_reader(field_type: FieldType, read_numbers: Reader) -> Reader:
    """Return the function that reads arrays of a fixed count of numbers.

    Args:
        field_type: The type of the array.
        read_numbers: Reads other containers into an `array.array`.
    """
    dtype = _dtype(field_type.kind)
    shape = (field_type.array_bound,)

    def read(value: object) -> NDArray[Any]:
        if type(value) is np.ndarray and value.dtype == dtype:
            if value.shape == shape:
                return value
            if value.ndim > 0:
                check_length(field_type, value.size)
                return value.reshape(-1)
        return np.array(read_numbers(value), dtype)

    return read


def read_array(kind: str, value: object) -> NDArray[Any] | None:
    """Return an array as numbers of a kind, in one dimension.

    Returns:
        None if some numbers are of another kind or out of range: then each must be checked.
    """
    given: NDArray[Any] = np.asarray(value)
    wanted = _dtype(kind)
    if given.ndim == 0 or not _fits(kind, given):
        return None
    return given.reshape(-1).astype(wanted, copy=False)


def _fits(kind: str, given: NDArray[Any]) -> bool:
    wanted = _dtype(kind)
    if given.dtype == wanted:
        return True
    if kind in INTEGER_RANGES:
        low, high = INTEGER_RANGES[kind]
        if given.dtype.kind not in 'iu':
            return False
        return not given.size or (low <= int(given.min()) and int(given.max()) <= high)
    if given.dtype.kind not in 'iuf':
        return False
    limit = float(np.finfo(wanted).max)
    return bool(np.all((np.abs(given) <= limit) | ~np.isfinite(given)))


def _dtype(kind: str) -> np.dtype[Any]:
    return np.dtype('uint8' if kind == 'char' else kind)
