"""Rules of what a file is made of."""

from __future__ import annotations

from composer.rules.record import Family, Rule

_YAML = 'https://yaml.org/spec/1.2.2/'
_SCHEMA = 'schemas/composer.schema.json, see docs/reference.md'

STRUCTURE = Family(
    'structure',
    'what a file is made of',
    (
        Rule(
            'nothing-to-check',
            'A pattern matches no file, or a folder holds no system.',
            'A check of nothing would pass, and nobody would notice that a path is wrong.',
        ),
        Rule(
            'unreadable-file',
            'The file is not there, may not be read, is empty, is not UTF-8, or has over 10 MB.',
            'Nothing is known of a file that cannot be read.',
            f'{_YAML}#52-character-encodings',
        ),
        Rule(
            'yaml-syntax',
            'The text is not YAML.',
            'The rest of the file cannot be understood before this is mended.',
            _YAML,
        ),
        Rule(
            'several-documents',
            'The file holds more than one YAML document.',
            'A file is one system; a second document would be silently left out.',
            f'{_YAML}#92-streams',
        ),
        Rule(
            'duplicate-key',
            'A key stands twice in one mapping.',
            'YAML forbids it, and most parsers silently take the last one.',
            f'{_YAML}#3213-node-comparison',
        ),
        Rule(
            'bad-key',
            'A key is not a string: a number, true, a list, a mapping, or nothing.',
            'All keys of the language, and all names of ROS, are strings.',
            _SCHEMA,
        ),
        Rule(
            'bad-scalar',
            'A scalar does not fit its tag, the tag is unknown, or a number is beyond all bounds.',
            "Only the tags of YAML's core schema are read: no tag runs code or makes objects.",
            f'{_YAML}#103-core-schema',
        ),
        Rule(
            'bad-tag',
            'A mapping or list has a tag that makes something else of it.',
            "Only the tags of YAML's core schema are read: no tag runs code or makes objects.",
            f'{_YAML}#103-core-schema',
        ),
        Rule(
            'bad-merge',
            'The merge key << is given something that is no mapping.',
            'There is nothing to merge in it.',
            'https://yaml.org/type/merge.html',
        ),
        Rule(
            'unknown-alias',
            'An alias names an anchor that does not stand before it.',
            'There is nothing that it could repeat.',
            f'{_YAML}#71-alias-nodes',
        ),
        Rule(
            'cyclic-alias',
            'An alias lies within what it repeats.',
            'The data would have no end.',
            f'{_YAML}#71-alias-nodes',
        ),
        Rule(
            'alias-bomb',
            'Aliases of aliases expand to more than a million values.',
            'A few lines would fill the memory of the machine.',
        ),
        Rule(
            'too-deep',
            'The data nest more than 100 levels deep.',
            'No system needs that; programs that read it would run out of stack.',
        ),
        Rule(
            'unsupported-version',
            'The version of the format is not one that this Composer reads.',
            'A later version may give the same keys another meaning.',
            _SCHEMA,
        ),
        Rule(
            'unknown-key',
            'A key is not one of the language at this place.',
            'A misspelt key would be silently without effect.',
            _SCHEMA,
        ),
        Rule(
            'missing-key',
            'A key that has to be there is not.',
            'The entry is not complete: a timer needs a period, a publisher a type.',
            _SCHEMA,
        ),
        Rule(
            'conflicting-keys',
            'Two keys exclude each other.',
            'It could not be told which of them counts.',
            _SCHEMA,
        ),
        Rule(
            'wrong-type',
            'A value is of another type than its key takes.',
            'A text where a number is wanted is a mistake, not something to convert by guess.',
            _SCHEMA,
        ),
        Rule(
            'bad-value',
            'A value is none of those that its key takes.',
            'What is meant cannot be told, and ROS would refuse it or take a default.',
            _SCHEMA,
        ),
        Rule(
            'out-of-range',
            'A number, text or list is smaller or larger than its key allows.',
            'ROS would refuse it when the entity is created.',
            _SCHEMA,
        ),
    ),
)
