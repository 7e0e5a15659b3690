"""What the stubs of all systems share."""

from collections.abc import Iterator
from typing import Any, Generic, Literal, Protocol, TypeVar

_Item = TypeVar('_Item', covariant=True)
_Message = TypeVar('_Message', covariant=True)
_Feedback = TypeVar('_Feedback', covariant=True)
_Result = TypeVar('_Result', covariant=True)

class NumPyScalar(Protocol):
    """A scalar of NumPy."""

    @property
    def __array_interface__(self) -> dict[str, Any]: ...
    @property
    def itemsize(self) -> int: ...
    def __hash__(self) -> int: ...

class PythonFloat(Protocol):
    """A `float`, and no `int`: rclpy sends a whole number in a field for floats as another one."""

    def hex(self) -> str: ...
    def is_integer(self) -> bool: ...

class Items(Protocol[_Item]):
    """Several items: any sequence but a text, or an array; no mapping."""

    def __contains__(self, value: object, /) -> bool: ...
    def __getitem__(self, index: int, /) -> object: ...
    def __iter__(self) -> Iterator[_Item]: ...
    def __len__(self) -> int: ...

class ToMsg(Protocol[_Message]):
    """What stands for a message, as rclpy's `Time` and `Duration` do."""

    def to_msg(self) -> _Message: ...

class Goal(Protocol, Generic[_Feedback, _Result]):
    """A goal that a server has accepted."""

    @property
    def status(
        self,
    ) -> Literal[
        'unknown', 'accepted', 'executing', 'canceling', 'succeeded', 'canceled', 'aborted'
    ]: ...
    @property
    def feedback(self) -> Iterator[_Feedback]: ...
    def cancel(self, timeout: float | None = 5.0) -> bool: ...
    def result(self, timeout: float | None = None) -> _Result: ...
    async def result_async(self) -> _Result: ...
    feedback_queue: Any
    result_future: Any

class Logger(Protocol):
    """The ROS logger of a node."""

    name: str
    def get_child(self, name: str) -> Logger: ...
    def set_level(self, level: Any) -> None: ...
    def get_effective_level(self) -> Any: ...
    def is_enabled_for(self, severity: Any) -> bool: ...
    def log(
        self,
        message: Any,
        severity: Any,
        *,
        name: str = ...,
        throttle_duration_sec: float = ...,
        throttle_time_source_type: Any = ...,
        skip_first: bool = ...,
        once: bool = ...,
    ) -> bool: ...
    def debug(
        self,
        message: Any,
        *,
        name: str = ...,
        throttle_duration_sec: float = ...,
        throttle_time_source_type: Any = ...,
        skip_first: bool = ...,
        once: bool = ...,
    ) -> bool: ...
    def info(
        self,
        message: Any,
        *,
        name: str = ...,
        throttle_duration_sec: float = ...,
        throttle_time_source_type: Any = ...,
        skip_first: bool = ...,
        once: bool = ...,
    ) -> bool: ...
    def warning(
        self,
        message: Any,
        *,
        name: str = ...,
        throttle_duration_sec: float = ...,
        throttle_time_source_type: Any = ...,
        skip_first: bool = ...,
        once: bool = ...,
    ) -> bool: ...
    def warn(
        self,
        message: Any,
        *,
        name: str = ...,
        throttle_duration_sec: float = ...,
        throttle_time_source_type: Any = ...,
        skip_first: bool = ...,
        once: bool = ...,
    ) -> bool: ...
    def error(
        self,
        message: Any,
        *,
        name: str = ...,
        throttle_duration_sec: float = ...,
        throttle_time_source_type: Any = ...,
        skip_first: bool = ...,
        once: bool = ...,
    ) -> bool: ...
    def fatal(
        self,
        message: Any,
        *,
        name: str = ...,
        throttle_duration_sec: float = ...,
        throttle_time_source_type: Any = ...,
        skip_first: bool = ...,
        once: bool = ...,
    ) -> bool: ...
