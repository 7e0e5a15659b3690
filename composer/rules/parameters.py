"""Rules of parameters."""

from __future__ import annotations

from composer.diagnostics import Severity
from composer.rules.record import Family, Rule

PARAMETERS = Family(
    'parameters',
    'declarations of parameters',
    (
        Rule(
            'bad-parameter',
            'A declaration contradicts itself: its type, value, range, step and choices.',
            'ROS refuses the declaration when the node is created, or takes it as something else.',
            'https://docs.ros.org/en/jazzy/Concepts/Basic/About-Parameters.html',
        ),
        Rule(
            'unreachable-parameters',
            'A node hears of changes with `on_parameters`, and has no parameter services.',
            'Nobody else can change its parameters: `ros2 param set` needs these services.',
            'https://docs.ros.org/en/jazzy/Concepts/Basic/About-Parameters.html',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
    ),
)
