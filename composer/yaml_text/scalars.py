"""The core schema of YAML 1.2.2 (section 10.3.2): which type a plain scalar has."""

from __future__ import annotations

import re
from typing import TypeAlias

Scalar: TypeAlias = str | int | float | bool | None

_NULL = frozenset({'', '~', 'null', 'Null', 'NULL'})
BOOLS = {'true': True, 'True': True, 'TRUE': True, 'false': False, 'False': False, 'FALSE': False}
# What is a text here, and a bool in YAML 1.1 and in ROS's parameter files.
BOOLS_OF_YAML_1_1 = {
    **dict.fromkeys(('y', 'Y', 'yes', 'Yes', 'YES', 'on', 'On', 'ON'), True),
    **dict.fromkeys(('n', 'N', 'no', 'No', 'NO', 'off', 'Off', 'OFF'), False),
}
_INT = re.compile(r'[-+]?[0-9]+')
_OCT = re.compile(r'0o[0-7]+')
_HEX = re.compile(r'0x[0-9a-fA-F]+')
_FLOAT = re.compile(r'[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?')
_INF = re.compile(r'[-+]?\.(inf|Inf|INF)')
_NAN = frozenset({'.nan', '.NaN', '.NAN'})
_NUMBER_START = frozenset('+-.0123456789')
# All others begin a text.
_OTHER_START = _NUMBER_START | {text[0] for text in (*_NULL, *BOOLS) if text}

# No ROS field or parameter holds an integer of more than 20 digits. Beyond this bound they are not
# even doubles, and much longer ones Python will not read or print (sys.set_int_max_str_digits).
_MAX_DIGITS = 250

_TAG_PREFIX = 'tag:yaml.org,2002:'
TAG_STR = _TAG_PREFIX + 'str'
TAG_MAP = _TAG_PREFIX + 'map'
TAG_SEQ = _TAG_PREFIX + 'seq'
_TAGGED_TYPES: dict[str, tuple[type, ...]] = {
    _TAG_PREFIX + 'null': (type(None),),
    _TAG_PREFIX + 'bool': (bool,),
    _TAG_PREFIX + 'int': (int,),
    _TAG_PREFIX + 'float': (float, int),
}


class ScalarError(ValueError):
    """The text does not fit its tag, or is a number that is too long."""


def parse_plain_scalar(text: str) -> Scalar:
    """Return the value of an untagged plain scalar.

    Raises:
        ScalarError: A number is longer than 250 digits.
    """
    if text and text[0] not in _OTHER_START:
        return text
    if text in _NULL:
        return None
    if text in BOOLS:
        return BOOLS[text]
    return _parse_number(text) if text[0] in _NUMBER_START else text


def parse_tagged_scalar(text: str, tag: str) -> Scalar:
    """Return the value of a scalar with an explicit tag, as in `!!float 1`.

    Raises:
        ScalarError: The tag is none of the core schema's, or the text does not fit it.
    """
    if tag == TAG_STR:
        return text
    types = _TAGGED_TYPES.get(tag)
    if types is None:
        message = f"the tag {short_tag(tag)} is not part of YAML's core schema"
        raise ScalarError(message)
    value = parse_plain_scalar(text)
    if not isinstance(value, types) or (isinstance(value, bool) and bool not in types):
        message = f'{text!r} is not a {short_tag(tag)}'
        raise ScalarError(message)
    return float(value) if float in types and isinstance(value, int) else value


def format_scalar(value: Scalar) -> str:
    """Return a scalar other than null as YAML has it, without quotes."""
    if isinstance(value, bool):
        return 'true' if value else 'false'
    return str(value)


def suggest_bool(value: object) -> str | None:
    """Return the help for a value that has to be a bool, if it is one in YAML 1.1."""
    meant = BOOLS_OF_YAML_1_1.get(value) if isinstance(value, str) else None
    return None if meant is None else f'write {format_scalar(meant)}'


def suggest_flat(item: object) -> str | None:
    """Return the help for an item of a list that a parameter cannot have."""
    if isinstance(item, dict):
        return 'write a list for each of their keys'
    return 'write one flat list, or a text in quotes' if isinstance(item, list) else None


def short_tag(tag: str) -> str:
    """Return a tag as people write it: `!!str` for YAML's own ones."""
    return '!!' + tag.removeprefix(_TAG_PREFIX) if tag.startswith(_TAG_PREFIX) else tag


def _parse_number(text: str) -> Scalar:
    if len(text) > _MAX_DIGITS and any(kind.fullmatch(text) for kind in (_INT, _OCT, _HEX)):
        message = f'a number of {len(text)} digits does not fit any ROS type'
        raise ScalarError(message)
    if _INT.fullmatch(text):
        return int(text, 10)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _OCT.fullmatch(text):
        return int(text, 8)
    if _HEX.fullmatch(text):
        return int(text, 16)
    if _INF.fullmatch(text):
        return float('-inf') if text[0] == '-' else float('inf')
    if text in _NAN:
        return float('nan')
    return text
