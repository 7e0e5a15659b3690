"""Rules of payloads and of what makes them."""

from __future__ import annotations

from composer.rules.record import Family, Rule

_TYPES = 'https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html#field-types'

FIELDS = Family(
    'fields',
    'messages that the file describes, against the fields of their type',
    (
        Rule(
            'unknown-field',
            'The type has no field of this name, in a message or in an expression of `transform`.',
            'The message could not be made.',
            _TYPES,
            needs='interfaces',
        ),
        Rule(
            'field-type',
            'A value is of another type than its field.',
            'The message could not be made.',
            _TYPES,
            needs='interfaces',
        ),
        Rule(
            'field-range',
            'A number does not fit into its field.',
            'The message could not be made, or would carry another number.',
            _TYPES,
            needs='interfaces',
        ),
        Rule(
            'field-length',
            'A list or text is longer than its field, or a list shorter than a fixed array.',
            'The message could not be made.',
            _TYPES,
            needs='interfaces',
        ),
        Rule(
            'field-text',
            'A text has characters that its field cannot hold.',
            'It would not arrive as it was written.',
            'https://design.ros2.org/articles/wide_strings.html',
            needs='interfaces',
        ),
    ),
)
