"""Take messages as the middleware has them, each with the publisher that it is from.

rclpy tells neither the publisher of a message, nor takes one without an executor. The structures
are those of Jazzy and Kilted: rmw/types.h, rcutils/types/uint8_array.h, rcutils/allocator.h.
"""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

if TYPE_CHECKING:
    from rclpy.publisher import Publisher as RosPublisher
    from rclpy.subscription import Subscription as RosSubscription

_GID_SIZE: Final = 16
_OK: Final = 0
_rcl = ctypes.CDLL(_rclpy.__file__)


class _Allocator(ctypes.Structure):
    _fields_ = tuple(
        (name, ctypes.c_void_p)
        for name in ('allocate', 'deallocate', 'reallocate', 'zero_allocate', 'state')
    )


class _Array(ctypes.Structure):
    _fields_ = (
        ('buffer', ctypes.c_void_p),
        ('length', ctypes.c_size_t),
        ('capacity', ctypes.c_size_t),
        ('allocator', _Allocator),
    )


class _Gid(ctypes.Structure):
    _fields_ = (
        ('implementation_identifier', ctypes.c_char_p),
        ('data', ctypes.c_uint8 * _GID_SIZE),
    )


class _MessageInfo(ctypes.Structure):
    _fields_ = (
        ('source_timestamp', ctypes.c_int64),
        ('received_timestamp', ctypes.c_int64),
        ('publication_sequence_number', ctypes.c_uint64),
        ('reception_sequence_number', ctypes.c_uint64),
        ('publisher_gid', _Gid),
        ('from_intra_process', ctypes.c_bool),
    )


_rcl.rcutils_get_default_allocator.restype = _Allocator
_rcl.rcutils_uint8_array_init.argtypes = (
    ctypes.POINTER(_Array),
    ctypes.c_size_t,
    ctypes.POINTER(_Allocator),
)
_rcl.rcutils_uint8_array_fini.argtypes = (ctypes.POINTER(_Array),)
_rcl.rcl_take_serialized_message.argtypes = (
    ctypes.c_void_p,
    ctypes.POINTER(_Array),
    ctypes.POINTER(_MessageInfo),
    ctypes.c_void_p,
)
_rcl.rcl_publisher_get_rmw_handle.argtypes = (ctypes.c_void_p,)
_rcl.rcl_publisher_get_rmw_handle.restype = ctypes.c_void_p
_rcl.rmw_get_gid_for_publisher.argtypes = (ctypes.c_void_p, ctypes.POINTER(_Gid))


class SerializedMessage(NamedTuple):
    """A message as it was received.

    Attributes:
        publisher: What tells its publisher from all others.
        published_ns: When it was published, in ns since 1970; 0 if nobody knows.
        received_ns: When it was received.
        data: It in CDR.
    """

    publisher: bytes
    published_ns: int
    received_ns: int
    data: bytes


class MessageTaker:
    """Takes messages of subscriptions, in one thread."""

    def __init__(self) -> None:
        self._allocator = _rcl.rcutils_get_default_allocator()
        self._array, self._info = _Array(), _MessageInfo()
        _rcl.rcutils_uint8_array_init(self._array, 0, self._allocator)

    def take(self, subscription: RosSubscription) -> SerializedMessage | None:
        """Return the next message of a subscription; `None` if it has none."""
        array, info = self._array, self._info
        handle: Any = subscription.handle
        with handle:
            result = _rcl.rcl_take_serialized_message(handle.pointer, array, info, None)
        if result != _OK:
            _rcl.rcutils_reset_error()
            return None
        data = ctypes.string_at(array.buffer, array.length)
        publisher = bytes(info.publisher_gid.data)
        return SerializedMessage(publisher, info.source_timestamp, info.received_timestamp, data)

    def close(self) -> None:
        """Give back the memory."""
        _rcl.rcutils_uint8_array_fini(self._array)


def identify_publisher(publisher: RosPublisher) -> bytes:
    """Return what tells a publisher from all others; see `SerializedMessage`."""
    gid, handle = _Gid(), publisher.handle
    with handle:
        entity = _rcl.rcl_publisher_get_rmw_handle(handle.pointer)
        if _rcl.rmw_get_gid_for_publisher(entity, gid) != _OK:
            _rcl.rcutils_reset_error()
            return b''
    return bytes(gid.data)
