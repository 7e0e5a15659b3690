"""Rules of the names that ROS will see."""

from __future__ import annotations

from composer.rules.record import Family, Rule

_NAMES = 'https://design.ros2.org/articles/topic_and_service_names.html'

NAMES = Family(
    'names',
    "names, by ROS's own rules",
    (
        Rule(
            'bad-name',
            'A node, namespace, topic, service, action, parameter or QoS profile has a name that '
            'ROS does not allow.',
            'ROS refuses to create it.',
            _NAMES,
        ),
        Rule(
            'duplicate-node',
            'Two nodes have one full name.',
            'Tools could not tell them apart, and their parameters and logs would be mixed up.',
            'https://docs.ros.org/en/jazzy/Concepts/Basic/About-Nodes.html',
        ),
        Rule(
            'bad-remap',
            'A remapping rule renames what is not remapped, or has an unknown scheme.',
            'ROS refuses the rule, or it would be without effect.',
            'https://docs.ros.org/en/jazzy/How-To-Guides/Node-arguments.html',
        ),
    ),
)
