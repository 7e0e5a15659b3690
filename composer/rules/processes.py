"""Rules of foreign processes, of what is waited for, and of the environment."""

from __future__ import annotations

from composer.rules.record import Family, Rule

PROCESSES = Family(
    'processes',
    'foreign processes, what is waited for, and the environment',
    (
        Rule(
            'missing-package',
            'A process names a ROS package that is not installed.',
            'Its program cannot be found.',
            needs='interfaces',
            is_ignorable=True,
        ),
        Rule(
            'unknown-executable',
            'A process names a program that its package has not.',
            'Nothing could be started.',
            'https://docs.ros.org/en/jazzy/How-To-Guides/Run-2-nodes-in-single-or-separate-processes.html',
            needs='interfaces',
            is_ignorable=True,
        ),
        Rule(
            'unknown-process',
            'Something waits for a process that the system does not declare.',
            'It would wait until its timeout, and the start would fail.',
        ),
        Rule(
            'wait-cycle',
            'Nodes or processes wait for each other in a circle.',
            'None of them would ever start.',
        ),
        Rule(
            'bad-environment',
            'An environment variable of ROS has a value that it does not take.',
            'ROS cannot start, or is alone in a domain of its own.',
            'https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Domain-ID.html',
            is_ignorable=True,
        ),
    ),
)
