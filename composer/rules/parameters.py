"""Rules of parameters."""

from __future__ import annotations

from composer.diagnostics import Severity
from composer.rules.record import Family, Rule

_FILES = 'https://docs.ros.org/en/jazzy/Concepts/Basic/About-Parameters.html'

PARAMETERS = Family(
    'parameters',
    'declarations of parameters, and parameter files',
    (
        Rule(
            'bad-parameter',
            'A declaration contradicts itself: its type, value, range, step and choices; or a '
            'parameter of a process has a value that ROS has no type for.',
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
        Rule(
            'bad-parameter-file',
            'A parameter file is not as ROS reads them.',
            'ROS refuses the file and no node starts, or it takes it as something else than is '
            'written.',
            _FILES,
        ),
        Rule(
            'unmatched-node-name',
            'A name in a parameter file matches none of the nodes that use the file.',
            'ROS says nothing, and the nodes run with other values.',
            _FILES,
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
        Rule(
            'undeclared-parameter',
            'A parameter file gives a parameter that no node which it is for declares.',
            'ROS says nothing, and ignores the value.',
            _FILES,
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
        Rule(
            'refused-parameter',
            'A value in a parameter file does not suit the declaration of the parameter.',
            'The node cannot be created. To ROS 1 is an integer, where a double is wanted, too.',
            _FILES,
        ),
        Rule(
            'overridden-parameter',
            'A value never counts, and neither a later file nor a more special name is why.',
            'ROS lets the last name that matches a node win, however special the others are, and '
            'of two values with two types the one whose type comes first.',
            _FILES,
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
    ),
)
