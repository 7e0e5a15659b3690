from __future__ import annotations

from dataclasses import dataclass, fields

from composer import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64


@dataclass(slots=True)
class Pid:
    kp: float = 0.0
    ki: float = 0.0
    kd: float = 0.0
    i_clamp: float = 1.0

    @classmethod
    def from_parameters(cls, node: Node, prefix: str = 'pid') -> Pid:
        return cls(**{f.name: node.parameters.get(f'{prefix}.{f.name}') for f in fields(cls)})


class Loop:
    def __init__(self, gains: Pid):
        self.gains, self.integral, self.error = gains, 0.0, None

    def __call__(self, error: float, dt: float) -> float:
        g = self.gains
        self.integral = max(-g.i_clamp, min(g.i_clamp, self.integral + error * dt))
        derivative = 0.0 if self.error is None else (error - self.error) / dt
        self.error = error
        return g.kp * error + g.ki * self.integral + g.kd * derivative


def control(node: Node, msg: JointState) -> Float64 | None:
    try:
        loop = node.state.loop
    except AttributeError:
        loop = node.state.loop = Loop(Pid.from_parameters(node))
    by_name = dict(zip(msg.name, msg.position))
    if (position := by_name.get('wheel')) is None:
        return None
    return Float64(data=loop(node.parameters.setpoint - position, 0.02))


def on_parameters(node: Node, changes: dict[str, object]) -> str | None:
    gains = {name.removeprefix('pid.'): value for name, value in changes.items() if name.startswith('pid.')}
    if negative := [name for name, value in gains.items() if value < 0]:
        return f'gains must not be negative: {", ".join(negative)}'
    if gains and hasattr(node.state, 'loop'):
        for name, value in gains.items():
            setattr(node.state.loop.gains, name, value)
    return None


def tune(node: Node):
    for factor in (1.1, 0.9):
        node.set_parameters(node.name, {'pid.kp': 2.0 * factor})
        yield


def apply_effort(node: Node, msg: Float64) -> None:
    node.state.effort = msg.data


def simulate(node: Node) -> dict:
    node.state.position += 0.02 * node.state.effort
    return dict(header=dict(stamp=node.now()), name=['wheel'], position=[node.state.position], effort=(node.state.effort,))
