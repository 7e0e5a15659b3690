"""The functions of rcl and rmw that rclpy does not offer, called through ctypes.

rcl calls a C function when an entity has something to take. Its signature is
`void (const void * user_data, size_t number_of_events)` (rcl/event_callback.h). The function
given here is libc's `eventfd_write(int fd, uint64_t value)`, with the descriptor as `user_data`:
in the 64-bit C calling conventions of Linux both pass their arguments in the same registers. So a
middleware thread adds to an eventfd and needs neither the GIL nor any lock of ours: it can never
wait for Python, and Python can never deadlock with it.

Only subscriptions, services, clients and timers are watched in this way. QoS events are not:
to arm one in Fast DDS takes the event's lock before the reader's, and delivery takes them the
other way round (ros2/rmw_fastrtps pull request 890).
"""

import ctypes
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, cast

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from composer.executor.descriptors import ExecutorError


def check_word_size(pointer_size: int) -> None:
    """Refuse a system on which the two functions take their arguments in different ways.

    Raises:
        ExecutorError: Addresses have another size than 8 bytes.
    """
    if pointer_size != ctypes.sizeof(ctypes.c_uint64):
        message = f'the executor needs a 64-bit system: this one has {8 * pointer_size} bits'
        raise ExecutorError(message)


check_word_size(ctypes.sizeof(ctypes.c_void_p))
_rcl = ctypes.CDLL(_rclpy.__file__)
_rcl_holding_gil = ctypes.PyDLL(_rclpy.__file__)
_EVENTFD_WRITE = ctypes.cast(ctypes.CDLL(None).eventfd_write, ctypes.c_void_p).value


# Event callbacks of entities


def _watch_function(rcl_name: str) -> Callable[[int, int | None], None]:
    function = getattr(_rcl, rcl_name)
    function.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
    function.restype = ctypes.c_int

    def watch(pointer: int, eventfd: int | None) -> None:
        """Add to `eventfd` whenever the entity at `pointer` has something new; None: stop."""
        callback = None if eventfd is None else _EVENTFD_WRITE
        if function(pointer, callback, eventfd) != _RCL_RET_OK:
            _rcl.rcutils_reset_error()
            rmw = _rclpy.rclpy_get_rmw_implementation_identifier()
            message = f'{rmw} does not announce new data: {rcl_name} failed'
            advice = 'use an RMW implementation with event callbacks, such as rmw_fastrtps_cpp'
            raise ExecutorError(message, help=advice)

    return watch


_RCL_RET_OK = 0
watch_subscription = _watch_function('rcl_subscription_set_on_new_message_callback')
watch_service = _watch_function('rcl_service_set_on_new_request_callback')
watch_client = _watch_function('rcl_client_set_on_new_response_callback')
watch_timer_reset = _watch_function('rcl_timer_set_on_reset_callback')


class _WaitSet(ctypes.Structure):
    """The public part of `rcl_wait_set_t` (rcl/wait.h)."""

    _fields_ = (
        ('subscriptions', ctypes.POINTER(ctypes.c_void_p)),
        ('subscription_count', ctypes.c_size_t),
        ('guard_conditions', ctypes.POINTER(ctypes.c_void_p)),
        ('guard_condition_count', ctypes.c_size_t),
        ('timers', ctypes.POINTER(ctypes.c_void_p)),
        ('timer_count', ctypes.c_size_t),
        ('clients', ctypes.POINTER(ctypes.c_void_p)),
        ('client_count', ctypes.c_size_t),
        ('services', ctypes.POINTER(ctypes.c_void_p)),
        ('service_count', ctypes.c_size_t),
        ('events', ctypes.POINTER(ctypes.c_void_p)),
        ('event_count', ctypes.c_size_t),
    )


def list_parts(wait_set: Any) -> list[tuple[Callable[[int, int | None], None], int]]:
    """List the parts of a waitable that has added itself to the empty `wait_set`.

    Returns:
        For each part, the function that watches it, and its address.
    """
    raw = _WaitSet.from_address(wait_set.pointer)
    kinds = (
        (watch_subscription, raw.subscriptions, raw.subscription_count),
        (watch_timer_reset, raw.timers, raw.timer_count),
        (watch_client, raw.clients, raw.client_count),
        (watch_service, raw.services, raw.service_count),
    )
    return [(watch, array[i]) for watch, array, count in kinds for i in range(count) if array[i]]


# What the middleware has, asked at once


class _Entities(ctypes.Structure):
    """`rmw_services_t` and its like: all are a number and an array of addresses (rmw/types.h)."""

    _fields_ = (('count', ctypes.c_size_t), ('addresses', ctypes.POINTER(ctypes.c_void_p)))


class _RmwEntity(ctypes.Structure):
    """What `rmw_service_t` and its like begin with."""

    _fields_ = (('implementation_identifier', ctypes.c_char_p), ('data', ctypes.c_void_p))


def _rmw_handle_function(rcl_name: str) -> Callable[[int], int]:
    function = getattr(_rcl_holding_gil, rcl_name)
    function.argtypes = (ctypes.c_void_p,)
    function.restype = ctypes.c_void_p
    return cast('Callable[[int], int]', function)


_rmw_context = _rmw_handle_function('rcl_context_get_rmw_context')
_rmw_guard_condition = _rmw_handle_function('rcl_guard_condition_get_rmw_handle')
_rmw_subscription = _rmw_handle_function('rcl_subscription_get_rmw_handle')
_rmw_service = _rmw_handle_function('rcl_service_get_rmw_handle')
_rmw_client = _rmw_handle_function('rcl_client_get_rmw_handle')
_rmw_event = _rmw_handle_function('rcl_event_get_rmw_handle')

_rcl_holding_gil.rcl_trigger_guard_condition.argtypes = (ctypes.c_void_p,)
_rcl.rmw_create_wait_set.argtypes = (ctypes.c_void_p, ctypes.c_size_t)
_rcl.rmw_create_wait_set.restype = ctypes.c_void_p
_rcl.rmw_destroy_wait_set.argtypes = (ctypes.c_void_p,)
_rcl.rmw_wait.argtypes = (*[ctypes.POINTER(_Entities)] * 5, ctypes.c_void_p, ctypes.c_void_p)


def _data_of(rmw_entity: int) -> int:
    data: int = _RmwEntity.from_address(rmw_entity).data
    return data


def find_rmw_event(wait_set: Any) -> int:
    """Return the address of the `rmw_event_t` of the only QoS event in `wait_set`."""
    return _rmw_event(_WaitSet.from_address(wait_set.pointer).events[0])


class Readiness:
    """Asks the middleware whether entities have something to take, at once.

    A guard condition that is triggered keeps `rmw_wait` from waiting, and from all that it does
    before it waits. The entities must not be destroyed meanwhile.

    Args:
        context: The rclpy context of the entities.
    """

    def __init__(self, context: Any) -> None:
        self._context = context.handle
        self._lock = threading.Lock()
        with self._context:
            self._guard = _rclpy.GuardCondition(self._context)
            rmw_context = _rmw_context(self._context.pointer)
            self._wait_set = _rcl.rmw_create_wait_set(rmw_context, 0)
        self._no_timeout = (ctypes.c_uint64 * 2)()

    def has_messages(self, subscription: int) -> bool:
        """Ask for the `rcl_subscription_t` at that address."""
        return bool(self._wait(0, (_data_of(_rmw_subscription(subscription)),)))

    def has_requests(self, service: int) -> bool:
        """Ask for the `rcl_service_t` at that address."""
        return bool(self._wait(2, (_data_of(_rmw_service(service)),)))

    def has_responses(self, client: int) -> bool:
        """Ask for the `rcl_client_t` at that address."""
        return bool(self._wait(3, (_data_of(_rmw_client(client)),)))

    def list_happened(self, rmw_events: Sequence[int]) -> list[int]:
        """Return the indices of the `rmw_event_t` that have happened since they were taken."""
        return self._wait(4, rmw_events)

    def _wait(self, position: int, addresses: Sequence[int]) -> list[int]:
        """Return the indices of what is ready among one kind, given by `rmw_wait`'s argument."""
        asked = (ctypes.c_void_p * len(addresses))(*addresses)
        with self._lock, self._context, self._guard:
            _rcl_holding_gil.rcl_trigger_guard_condition(self._guard.pointer)
            guard = (ctypes.c_void_p * 1)(_data_of(_rmw_guard_condition(self._guard.pointer)))
            kinds: list[Any] = [None] * 5
            kinds[1] = _Entities(1, guard)
            kinds[position] = _Entities(len(addresses), asked)
            result = _rcl.rmw_wait(*kinds, self._wait_set, self._no_timeout)
        if result != _RCL_RET_OK:
            _rcl.rcutils_reset_error()
            return []
        return [index for index, address in enumerate(asked) if address]

    def __del__(self) -> None:
        with suppress(AttributeError):  # `__init__` may have failed half-way.
            # The guard condition keeps what is left of the context until after this.
            _rcl.rmw_destroy_wait_set(self._wait_set)


# Timers

_time_until_next_call = _rcl_holding_gil.rcl_timer_get_time_until_next_call
_time_until_next_call.argtypes = (ctypes.c_void_p, ctypes.POINTER(ctypes.c_int64))
_time_until_next_call.restype = ctypes.c_int


def time_until_next_call(pointer: int) -> int | None:
    """Nanoseconds until the `rcl_timer_t` at `pointer` is due, or None if it is cancelled."""
    until = ctypes.c_int64()
    if _time_until_next_call(pointer, ctypes.byref(until)) != _RCL_RET_OK:
        _rcl.rcutils_reset_error()
        return None
    return until.value
