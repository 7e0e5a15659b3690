"""Rules of what names something else."""

from __future__ import annotations

from composer.diagnostics import Severity
from composer.rules.record import Family, Rule

_QOS = 'https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Quality-of-Service-Settings.html'
_INTERFACES = 'https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html'

REFERENCES = Family(
    'references',
    'what names something else',
    (
        Rule(
            'unknown-type',
            'An interface type is not installed, or its package has no such type.',
            'No publisher, subscription, service or action can be created without it.',
            _INTERFACES,
            needs='interfaces',
            is_ignorable=True,
        ),
        Rule(
            'unknown-publisher',
            '`publish:` or a behaviour names a publisher that the node does not declare.',
            'There is nothing that could publish it.',
            is_ignorable=True,
        ),
        Rule(
            'type-mismatch',
            'A subscription passes its messages on to a publisher of another type.',
            'A publisher takes messages of its own type alone.',
            _INTERFACES,
        ),
        Rule(
            'unknown-qos-profile',
            '`qos:` names a profile that neither ROS nor the file has.',
            'A publisher with a default instead may never match its subscriptions.',
            _QOS,
        ),
        Rule(
            'cyclic-qos-profile',
            'A QoS profile starts from itself, directly or through others.',
            'Its policies have no values.',
        ),
        Rule(
            'likely-misspelling',
            'What is waited for, remapped, or a callback group is all but called like something '
            'of the system.',
            'It may be elsewhere, so that ROS and Composer would take it as it is.',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
        Rule(
            'unknown-interfaces',
            '`interfaces:` names a folder that is not there.',
            'The package can be neither checked nor built.',
        ),
    ),
)
