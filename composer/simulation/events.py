"""What happens in a simulated system: one event after the other, in one order."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.records import record

if TYPE_CHECKING:
    from composer.runtime.nodes.system_handle import EventKind


@record
class Event:
    """Something that happened.

    Attributes:
        time_ns: When, since the start of the system, in virtual time.
        kind: What: `message` was published; `request`, `response`, `goal`, `cancel`, `feedback`
            and `result` came to their end; `parameter` was set; `state` is that of a lifecycle;
            `callback` began; `error` was raised by a behaviour; `exit` is the end of the system.
        node: The full name of the node that did it; empty for the scenario itself.
        name: The full name of the topic, service or action; the parameter's name; the level of a
            log line in small letters; the owner of a callback or an error, as `timer 'tick'`.
        value: The message (of an interface class; of a result, `(status, message)`, with a status
            as `succeeded`); the value of the parameter; the text of a line or a traceback; the
            name of the state; the exit code. Nobody changes it.
    """

    time_ns: int
    kind: EventKind
    node: str
    name: str
    value: Any = None
