"""Relay, throttle, drop, mux and transform messages of any type from topic to topic.

Bind them to subscriptions with `publish:`. They do what `topic_tools` of ROS do, but within the
process of the other nodes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from jinja2 import StrictUndefined

from composer.errors import ComposerError
from composer.expressions.evaluation import evaluate_expression
from composer.expressions.limits import Budget
from composer.expressions.sandbox import Sandbox

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer import Node


class TransformError(ComposerError):
    """An expression of `transform` cannot be evaluated for a message."""


def relay(_node: Node, message: Any) -> Any:
    """Pass every message on, as a subscription with `publish:` and no behaviour does.

    ```yaml
    subscriptions:
      scan: {type: sensor_msgs/msg/LaserScan, behaviour: behaviours.topics:relay, publish: copy}
    ```
    """
    return message


def throttle(node: Node, message: Any, rate: Annotated[float, '> 0']) -> Any | None:
    """Pass on at most `rate` messages a second, by the clock of the node.

    ```yaml
    subscriptions:
      scan:
        type: sensor_msgs/msg/LaserScan
        behaviour: behaviours.topics:throttle
        with: {rate: 5.0}
        publish: slow_scan
    ```
    """
    period_ns = 1e9 / rate
    now_ns = node.now().nanoseconds
    due_ns = node.own_state.get('due_ns', now_ns)
    # Simulated time may jump back.
    if now_ns < due_ns <= now_ns + period_ns:
        return None
    # Count from when it was due: otherwise 10 messages a second become 2.5 with `rate: 3`.
    is_late = not due_ns <= now_ns < due_ns + period_ns
    node.own_state['due_ns'] = (now_ns if is_late else due_ns) + period_ns
    return message


def drop(
    node: Node, message: Any, count: Annotated[int, '>= 0', '< of'], of: Annotated[int, '>= 1']
) -> Any | None:
    """Drop the first `count` of every `of` messages, and pass on the others.

    ```yaml
    subscriptions:
      image:
        type: sensor_msgs/msg/Image
        qos: sensor_data
        behaviour: behaviours.topics:drop
        with: {count: 2, of: 3}
        publish: third_image
    ```
    """
    heard = node.own_state.get('heard', 0)
    node.own_state['heard'] = heard + 1
    return message if heard % of >= count else None


def mux(node: Node, message: Any, source: str) -> Any | None:
    """Pass messages on while the parameter `selected` of the node is their source.

    `ros2 param set` selects another source while the system runs.

    ```yaml
    parameters:
      selected: {default: autopilot, choices: [autopilot, joystick]}
    publishers:
      cmd_vel: geometry_msgs/msg/Twist
    subscriptions:
      autopilot/cmd_vel:
        type: geometry_msgs/msg/Twist
        behaviour: behaviours.topics:mux
        with: {source: autopilot}
        publish: cmd_vel
      joystick/cmd_vel:
        type: geometry_msgs/msg/Twist
        behaviour: behaviours.topics:mux
        with: {source: joystick}
        publish: cmd_vel
    ```
    """
    return message if node.parameters.selected == source else None


def transform(node: Node, message: Any, fields: Mapping[str, str]) -> dict[str, Any]:
    """Make a message of another type, with an expression for each field.

    Expressions are written without braces. They can use the fields of the received message, and
    the message itself as `message`. Fields without an expression keep their defaults.
    `composer check` checks the expressions, too.

    ```yaml
    subscriptions:
      speed:
        type: std_msgs/msg/Float64
        behaviour: behaviours.topics:transform
        with:
          fields:
            header.frame_id: "'base_link'"
            twist.linear.x: data / 3.6
        publish: velocity
    ```

    Raises:
        TransformError: An expression cannot be evaluated.
    """
    sandbox = node.own_state.setdefault('sandbox', Sandbox())
    # The limits on time and memory apply to each message.
    sandbox.budget = Budget()
    scope = {name: getattr(message, name) for name in message.get_fields_and_field_types()}
    payload: dict[str, Any] = {}
    for path, expression in fields.items():
        *outer, last = path.split('.')
        inner = payload
        for name in outer:
            inner = inner.setdefault(name, {})
        inner[last] = _evaluate(sandbox, expression, {'message': message} | scope, path)
    return payload


def _evaluate(sandbox: Sandbox, expression: str, scope: Mapping[str, Any], path: str) -> Any:
    try:
        value = evaluate_expression(sandbox, str(expression), scope)
        if isinstance(value, StrictUndefined):
            # Using it raises an error with the unknown name.
            str(value)
    except Exception as error:
        message = f"cannot evaluate '{expression}' for '{path}': {error}"
        raise TransformError(message, help=f'expressions can use {", ".join(scope)}') from error
    return value
