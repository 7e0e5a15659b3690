"""How the methods of the node, its goals and its logger are called."""

from __future__ import annotations

import inspect
from functools import cache
from types import NoneType
from typing import TYPE_CHECKING, get_args

from composer.inference.evaluation.operators import type_in_words, type_of
from composer.inference.values import alternatives

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.inference.values import Argument, Arguments

# A test holds these against `composer.Node`, its goals, and rclpy's logger.
_SIGNATURES: dict[tuple[str, str], str] = {
    ('node', 'call'): 'name: str, payload=None, timeout: float | None = 5.0',
    ('node', 'call_async'): 'name: str, payload=None, timeout: float | None = 5.0',
    ('node', 'create_client'): 'srv_type, srv_name: str, **options',
    ('node', 'create_publisher'): 'msg_type, topic: str, qos=None, **options',
    ('node', 'create_service'): 'srv_type, srv_name: str, behaviour, **options',
    ('node', 'create_subscription'): 'msg_type, topic: str, behaviour, qos=None, **options',
    ('node', 'create_timer'): 'period: float, behaviour, **options',
    ('node', 'destroy'): 'entity',
    ('node', 'get_parameters'): 'node_name: str, names, timeout: float | None = 5.0',
    ('node', 'now'): '',
    ('node', 'publish'): 'name: str, payload',
    ('node', 'send_goal'): 'name: str, payload=None, timeout: float | None = 5.0',
    ('node', 'set_parameters'): 'node_name: str, values, timeout: float | None = 5.0',
    ('node', 'shutdown'): 'code: int = 0',
    ('node', 'sleep'): 'seconds: float',
    ('goal', 'cancel'): 'timeout: float | None = 5.0',
    ('goal', 'result'): 'timeout: float | None = None',
    ('goal', 'result_async'): '',
    ('time', 'to_msg'): '',
    ('time', 'seconds_nanoseconds'): '',
    **{
        ('logger', name): 'message: str, *, throttle_duration_sec: float = 0.0, '
        'throttle_time_source_type=None, skip_first: bool = False, once: bool = False'
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
    return inspect.signature(scope[name], eval_str=True)  # type: ignore[arg-type]


def plainly(signature: inspect.Signature) -> str:
    """Return a signature without its types."""
    several = signature.parameters.values()
    return str(inspect.Signature([each.replace(annotation=each.empty) for each in several]))


def wrong_types(
    signature: inspect.Signature, arguments: Arguments
) -> Iterator[tuple[Argument, str]]:
    """Yield the arguments that are of another type than the signature says, and what it says."""
    if arguments.is_open:
        return
    bound = signature.bind(*arguments.positional, **dict(arguments.named))
    for name, argument in bound.arguments.items():
        wanted = signature.parameters[name].annotation
        if wanted is inspect.Parameter.empty:
            continue
        allowed = {*(get_args(wanted) or (wanted,))}
        allowed |= {int} if float in allowed else set()
        kinds = {type_of(each) for each in alternatives(argument.value)}
        if None not in kinds and not kinds & allowed:
            shown = ' or '.join(sorted(each.__name__ for each in allowed if each is not NoneType))
            yield argument, f"'{name}' is {type_in_words(argument.value)}, and has to be {shown}"


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
