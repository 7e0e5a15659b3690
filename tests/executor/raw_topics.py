"""Publishes any bytes on any topic of the middleware, as a peer with other types may do."""

import ctypes
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

_lib = ctypes.CDLL(_rclpy.__file__)
_python = ctypes.pythonapi
_KEEP_LAST, _RELIABLE, _VOLATILE = 1, 1, 2


class _Qos(ctypes.Structure):
    """`rmw_qos_profile_t` (rmw/types.h)."""

    _fields_ = (
        ('history', ctypes.c_int),
        ('depth', ctypes.c_size_t),
        ('reliability', ctypes.c_int),
        ('durability', ctypes.c_int),
        ('deadline', ctypes.c_uint64 * 2),
        ('lifespan', ctypes.c_uint64 * 2),
        ('liveliness', ctypes.c_int),
        ('liveliness_lease_duration', ctypes.c_uint64 * 2),
        ('avoid_ros_namespace_conventions', ctypes.c_bool),
    )


class _Bytes(ctypes.Structure):
    """`rcutils_uint8_array_t`."""

    _fields_ = (
        ('buffer', ctypes.c_char_p),
        ('length', ctypes.c_size_t),
        ('capacity', ctypes.c_size_t),
        ('allocator', ctypes.c_void_p * 5),
    )


_python.PyCapsule_GetName.restype = ctypes.c_char_p
_python.PyCapsule_GetName.argtypes = (ctypes.py_object,)
_python.PyCapsule_GetPointer.restype = ctypes.c_void_p
_python.PyCapsule_GetPointer.argtypes = (ctypes.py_object, ctypes.c_char_p)
_lib.rcl_node_get_rmw_handle.restype = ctypes.c_void_p
_lib.rcl_node_get_rmw_handle.argtypes = (ctypes.c_void_p,)
_lib.rmw_create_publisher.restype = ctypes.c_void_p
_lib.rmw_create_publisher.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p) + (
    ctypes.c_void_p,
) * 2
_lib.rmw_destroy_publisher.argtypes = (ctypes.c_void_p, ctypes.c_void_p)
_lib.rmw_publish_serialized_message.argtypes = (ctypes.c_void_p,) * 3
_lib.rmw_publisher_count_matched_subscriptions.argtypes = (ctypes.c_void_p,) * 2


class RawPublisher:
    """A publisher on a topic by the name that the middleware has for it, as `rq/addRequest`."""

    def __init__(self, node: Any, message_type: Any, topic: str) -> None:
        type(message_type).__import_type_support__()
        capsule = message_type._TYPE_SUPPORT
        type_support = _python.PyCapsule_GetPointer(capsule, _python.PyCapsule_GetName(capsule))
        qos = _Qos(
            history=_KEEP_LAST,
            depth=1000,
            reliability=_RELIABLE,
            durability=_VOLATILE,
            avoid_ros_namespace_conventions=True,
        )
        self._node = node
        self._rmw_node = _lib.rcl_node_get_rmw_handle(node.handle.pointer)
        self._publisher = _lib.rmw_create_publisher(
            self._rmw_node,
            type_support,
            topic.encode(),
            ctypes.byref(qos),
            ctypes.create_string_buffer(1024),  # Options that are all zero.
        )
        assert self._publisher, topic

    def is_matched(self) -> bool:
        count = ctypes.c_size_t()
        _lib.rmw_publisher_count_matched_subscriptions(self._publisher, ctypes.byref(count))
        return bool(count.value)

    def publish(self, data: bytes) -> None:
        message = _Bytes(data, len(data), len(data))
        assert not _lib.rmw_publish_serialized_message(
            self._publisher, ctypes.byref(message), None
        )

    def destroy(self) -> None:
        _lib.rmw_destroy_publisher(self._rmw_node, self._publisher)
