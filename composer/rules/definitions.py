"""Rules of interface definitions, the files below `interfaces:`."""

from __future__ import annotations

from composer.rules.record import Family, Rule

_INTERFACES = 'https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html'
_DESIGN = 'https://design.ros2.org/articles/legacy_interface_definition.html'

DEFINITIONS = Family(
    'definitions',
    'the definition files of interface packages',
    (
        Rule(
            'unreadable-interfaces',
            'The definitions cannot be read with what is installed.',
            'Their parser is a package of ROS, rosidl_adapter, which is missing here.',
            needs='interfaces',
        ),
        Rule(
            'unreadable',
            'A definition file cannot be read.',
            'The package cannot be built without it.',
            needs='interfaces',
        ),
        Rule(
            'not-utf-8',
            'A definition file is not UTF-8.',
            'The generators of ROS read UTF-8 alone.',
            needs='interfaces',
        ),
        Rule(
            'no-definitions',
            'The folder has no msg/, srv/ or action/ with definitions.',
            'A package without interfaces gives no types.',
            needs='interfaces',
        ),
        Rule(
            'misplaced-file',
            'A definition lies in the folder of another kind.',
            'The generators would leave it out.',
            _INTERFACES,
            needs='interfaces',
        ),
        Rule(
            'bad-syntax',
            'A definition file is not as ROS reads it.',
            'The generators would refuse it.',
            _DESIGN,
            needs='interfaces',
        ),
        Rule(
            'missing-separator',
            'A service lacks its line of three dashes, or an action one of its two.',
            'Request and response, or goal, result and feedback, cannot be told apart.',
            _INTERFACES,
            needs='interfaces',
        ),
        Rule(
            'bad-separator',
            'A line of dashes has more or fewer than three, or there are too many of them.',
            'ROS takes exactly three dashes as a separator, and nothing else.',
            _INTERFACES,
            needs='interfaces',
        ),
        Rule(
            'indented-definition',
            'A field or constant is indented.',
            'The parser of ROS takes an indented line with a comment as part of that comment.',
            _DESIGN,
            needs='interfaces',
        ),
        Rule(
            'missing-name',
            'A line has a type and no name.',
            'A field is its type and its name.',
            _INTERFACES,
            needs='interfaces',
        ),
        Rule(
            'bad-type',
            'A type is not written as ROS writes types.',
            'The generators would refuse it.',
            _INTERFACES,
            needs='interfaces',
        ),
        Rule(
            'bad-default',
            'A default value does not fit its field.',
            'The generators would refuse it, or write another value.',
            _INTERFACES,
            needs='interfaces',
        ),
        Rule(
            'bad-constant',
            'A constant has a type or value that constants cannot have.',
            'The generators would refuse it.',
            _INTERFACES,
            needs='interfaces',
        ),
        Rule(
            'duplicate-field',
            'Two fields of a message have one name.',
            'The generated code would not compile.',
            _INTERFACES,
            needs='interfaces',
        ),
        Rule(
            'duplicate-constant',
            'Two constants of a message have one name.',
            'The generated code would not compile.',
            _INTERFACES,
            needs='interfaces',
        ),
        Rule(
            'unknown-package',
            'A field is of a type whose package is neither installed nor declared.',
            'The package cannot be built without it.',
            _INTERFACES,
            needs='interfaces',
        ),
        Rule(
            'endless-type',
            'A message contains itself, directly or through others.',
            'It would need endless memory.',
            _INTERFACES,
            needs='interfaces',
        ),
        Rule(
            'circular-packages',
            'Packages need each other.',
            'None of them can be built first.',
            _INTERFACES,
            needs='interfaces',
        ),
    ),
)
