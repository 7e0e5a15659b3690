"""How the methods of the node, its goals and its logger are called."""

from __future__ import annotations

import inspect
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from composer.inference.values import Arguments

# A test holds these against `composer.Node`, its goals, and rclpy's logger.
_SIGNATURES: dict[tuple[str, str], str] = {
    ('node', 'call'): 'name, payload=None, timeout=5.0',
    ('node', 'call_async'): 'name, payload=None, timeout=5.0',
    ('node', 'create_client'): 'srv_type, srv_name, **options',
    ('node', 'create_publisher'): 'msg_type, topic, qos=None, **options',
    ('node', 'create_service'): 'srv_type, srv_name, behaviour, **options',
    ('node', 'create_subscription'): 'msg_type, topic, behaviour, qos=None, **options',
    ('node', 'create_timer'): 'period, behaviour, **options',
    ('node', 'destroy'): 'entity',
    ('node', 'get_parameters'): 'node_name, names, timeout=5.0',
    ('node', 'now'): '',
    ('node', 'publish'): 'name, payload',
    ('node', 'send_goal'): 'name, payload=None, timeout=5.0',
    ('node', 'set_parameters'): 'node_name, values, timeout=5.0',
    ('node', 'shutdown'): 'code=0',
    ('goal', 'cancel'): 'timeout=5.0',
    ('goal', 'result'): 'timeout=None',
    ('goal', 'result_async'): '',
    ('time', 'to_msg'): '',
    ('time', 'seconds_nanoseconds'): '',
    **{
        ('logger', name): 'message, **kwargs'
        for name in ('debug', 'info', 'warn', 'warning', 'error', 'fatal')
    },
}


@cache
def signature_of(owner: str, name: str) -> inspect.Signature | None:
    """Return how a method is called, if that is known.

    Args:
        owner: `node`, or a part of it: `logger`, `goal`, `time`.
    """
    text = _SIGNATURES.get((owner, name))
    if text is None:
        return None
    scope: dict[str, object] = {}
    exec(f'def {name}({text}): pass', scope)  # noqa: S102 (a line of the table above)
    return inspect.signature(scope[name])  # type: ignore[arg-type]


def explain_misfit(signature: inspect.Signature, arguments: Arguments) -> str | None:
    """Return why a function cannot be called with these arguments, `None` if it can."""
    names = dict(arguments.named)
    try:
        if arguments.is_open:
            signature.bind_partial(*arguments.positional, **names)
        else:
            signature.bind(*arguments.positional, **names)
    except TypeError as error:
        # Others may take the place of what is missing, or of what there is too much.
        return None if arguments.is_open else str(error)
    return None
