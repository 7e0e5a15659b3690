"""Rules of how the nodes of a system are connected."""

from __future__ import annotations

from composer.diagnostics import Severity
from composer.rules.record import Family, Rule

_QOS = 'https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Quality-of-Service-Settings.html'
_COMPATIBLE = f'{_QOS}#qos-compatibilities'
_NO_OTHER_END = 'It is most often a misspelt name or a wrong namespace. '

WIRING = Family(
    'wiring',
    'connections between all nodes of the system',
    (
        Rule(
            'conflicting-types',
            'One topic, service or action has two types.',
            'ROS 2 connects only ends of the same type, and says nothing about the others.',
            'https://design.ros2.org/articles/topic_and_service_names.html',
            is_ignorable=True,
        ),
        Rule(
            'incompatible-qos',
            'The QoS of two ends can never match: less is offered than requested.',
            'The middleware does not connect them, and no message arrives.',
            _COMPATIBLE,
            is_ignorable=True,
        ),
        Rule(
            'second-server',
            'A service or action has two servers.',
            'Both are asked, and which of them answers is undefined.',
            'https://docs.ros.org/en/jazzy/Concepts/Basic/About-Services.html',
            is_ignorable=True,
        ),
        Rule(
            'no-publisher',
            'Nothing in the system publishes what a subscription hears.',
            f'{_NO_OTHER_END}`external: true` says that the publisher is elsewhere.',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
        Rule(
            'no-subscription',
            'Nothing in the system hears what a publisher publishes.',
            f'{_NO_OTHER_END}`external: true` says that the subscription is elsewhere.',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
        Rule(
            'no-server',
            'Nothing in the system serves what a client calls.',
            f'{_NO_OTHER_END}`external: true` says that the server is elsewhere.',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
        Rule(
            'relay-loop',
            'Subscriptions pass each message on in a circle, with no behaviour between them.',
            'The first message runs for ever, as fast as the machine can.',
            is_ignorable=True,
        ),
        Rule(
            'message-loop',
            'What behaviours publish comes back to them in a circle.',
            'It runs for ever unless one of them returns nothing at some time.',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
    ),
)
