"""Check single lines of interface definitions.

The rules are those of `rosidl_adapter.parser`, and those of the code that the generators write: no
names that are keywords of C, C++ or Python, and no values that get lost on their way through IDL.
"""

import keyword
import math
import re
from collections.abc import Iterator
from typing import Final

from composer.diagnostics import Diagnostic, Span, diagnostic_at
from composer.interfaces.definitions.definition_parser import (
    DefinitionSyntaxError,
    load_parser,
    parse_value,
)
from composer.interfaces.definitions.statements import Statement
from composer.interfaces.field_values import FLOAT32_MAX
from composer.spelling import did_you_mean, find_nearest

_TYPE: Final = re.compile(
    r'(?P<base>[^<>=\[\]]+)(?P<bound><=[^<>=\[\]]*)?(?P<array>\[[^\[\]]*\])?',
)
# Generated code ends the process with sizes that no number of C can hold.
_BOUND: Final = re.compile(r'<=0*[1-9][0-9]{0,8}')
_ARRAY: Final = re.compile(r'\[((<=)?0*[1-9][0-9]{0,8})?\]')

# C11 and C++17: the generated sources are compiled as both.
_C_KEYWORDS: Final = """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t
    class compl const const_cast constexpr continue decltype default delete do double dynamic_cast
    else enum explicit export extern false float for friend goto if inline int long mutable
    namespace new noexcept not not_eq nullptr operator or or_eq private protected public register
    reinterpret_cast restrict return short signed sizeof static static_assert static_cast struct
    switch template this thread_local throw true try typedef typeid typename union unsigned using
    virtual void volatile wchar_t while xor xor_eq
"""
RESERVED_NAMES: Final = frozenset(_C_KEYWORDS.split()) | frozenset(keyword.kwlist)

# Names of types in other languages and in ROS 1.
_OTHER_NAMES: Final = {
    'boolean': 'bool',
    'int': 'int32',
    'integer': 'int32',
    'uint': 'uint32',
    'long': 'int64',
    'short': 'int16',
    'float': 'float32',
    'double': 'float64',
    'str': 'string',
    'octet': 'byte',
    'time': 'builtin_interfaces/Time',
    'duration': 'builtin_interfaces/Duration',
    'Header': 'std_msgs/Header',
}


def list_primitive_types() -> tuple[str, ...]:
    """Return the names of the primitive types."""
    # The parser knows these two, and the generators do not.
    ros1_types = {'time', 'duration'}
    return tuple(name for name in load_parser().PRIMITIVE_TYPES if name not in ros1_types)


def translate_type(name: str) -> str | None:
    """Return the ROS 2 name of a type that has another name elsewhere, or None."""
    return _OTHER_NAMES.get(name)


def find_message(package: str, type_text: str) -> str | None:
    """Return the message that a type refers to, such as `std_msgs/Header`, or None.

    Args:
        package: the package of names without one.
        type_text: such as `Header[]`; it may have errors.
    """
    match = _TYPE.fullmatch(type_text)
    other_package, _, name = match['base'].rpartition('/') if match else ('', '', '')
    if '/' in other_package or not load_parser().is_valid_message_name(name):
        return None
    return f'{other_package or package}/{name}'


def check_statement(statement: Statement) -> Iterator[Diagnostic]:
    """Check one line by itself: its indentation, type, name and value."""
    if statement.indent:
        yield _check_indent(statement)
    type_errors = list(_check_type(statement))
    yield from type_errors
    match statement.kind:
        case 'unfinished':
            message = f'expected a name after the type {statement.type.text!r}'
            yield diagnostic_at(statement.name, 'missing-name', message)
        case 'constant':
            yield from _check_constant_name(statement.name)
        case 'field':
            yield from _check_field_name(statement.name)
    if statement.value is not None and not type_errors:
        yield from _check_value(statement, statement.value)


def _check_indent(statement: Statement) -> Diagnostic:
    spaces = 'space' if statement.indent == 1 else f'{statement.indent} spaces'
    return diagnostic_at(
        Span(statement.type.source, statement.type.line, 1, statement.indent),
        'indented-definition',
        'a definition starts at the beginning of its line',
        help=f'remove the {spaces} before {statement.type.text!r}',
    )


def _check_type(statement: Statement) -> Iterator[Diagnostic]:
    span = statement.type
    match = _TYPE.fullmatch(span.text)
    if match is None:
        yield diagnostic_at(
            span,
            'bad-type',
            f'{span.text!r} is not a type',
            help='without spaces: int32[], int32[3] or int32[<=3] for arrays, string<=10 for text',
        )
        return
    base, bound, array = match['base'], match['bound'], match['array']
    primitive = base in list_primitive_types()
    if bound is not None:
        yield from _check_bound(span.narrowed_to(bound), base)
    if array is not None and not _ARRAY.fullmatch(array):
        yield diagnostic_at(
            span.narrowed_to(array),
            'bad-type',
            f'{array!r} is not the size of an array: expected [], [N] or [<=N] with N from 1',
        )
    if statement.kind == 'constant' and (bound or array or not primitive):
        yield diagnostic_at(
            span,
            'bad-constant',
            f'a constant cannot have the type {span.text!r}',
            help=f'its type is one of {", ".join(list_primitive_types())}',
        )
    elif not primitive:
        yield from _check_message_name(Span(span.source, span.line, span.column, len(base)))


def _check_bound(span: Span, base: str) -> Iterator[Diagnostic]:
    if base not in {'string', 'wstring'}:
        yield diagnostic_at(
            span,
            'bad-type',
            f'{base} takes no bound',
            help='string and wstring do; the bound of an array stands inside its brackets',
        )
    elif not _BOUND.fullmatch(span.text):
        yield diagnostic_at(
            span,
            'bad-type',
            f'{span.text!r} is not a bound: expected <= and a whole number from 1',
        )


def _check_message_name(span: Span) -> Iterator[Diagnostic]:
    """Check the form of a message's name, not whether there is such a message."""
    parser = load_parser()
    package, _, name = span.text.rpartition('/')
    if '/' in package:
        first = package.partition('/')[0]
        yield diagnostic_at(
            span,
            'bad-type',
            f'{span.text!r} is not a type: expected package/Message',
            help=did_you_mean(f'{first}/{name}'),
        )
    elif package and not parser.is_valid_package_name(package):
        yield diagnostic_at(span, 'bad-type', f'{package!r} is not the name of a package')
    elif not parser.is_valid_message_name(name):
        types = list_primitive_types()
        nearest = translate_type(span.text) or find_nearest(span.text, types)
        expected = f'expected package/Message, or one of {", ".join(types)}'
        yield diagnostic_at(
            span,
            'unknown-type',
            f'there is no type {span.text!r}',
            help=did_you_mean(nearest, expected),
        )


def _check_constant_name(span: Span) -> Iterator[Diagnostic]:
    parser = load_parser()
    if parser.is_valid_constant_name(span.text):
        return
    better = _snake_case(span.text).upper()
    advice = did_you_mean(better if parser.is_valid_constant_name(better) else None)
    if any(character in span.text for character in '"\'<>'):
        advice = 'a line with = is a constant: defaults and types with spaces cannot contain one'
    yield diagnostic_at(
        span,
        'bad-name',
        f'{span.text!r} is not the name of a constant: expected capitals, digits and single '
        'underscores',
        help=advice,
    )


def _check_field_name(span: Span) -> Iterator[Diagnostic]:
    parser = load_parser()
    if not parser.is_valid_field_name(span.text):
        better = _snake_case(span.text)
        yield diagnostic_at(
            span,
            'bad-name',
            f'{span.text!r} is not the name of a field: expected small letters, digits and single '
            'underscores, beginning with a letter',
            help=did_you_mean(better if parser.is_valid_field_name(better) else None),
        )
    elif span.text in RESERVED_NAMES:
        yield diagnostic_at(
            span,
            'bad-name',
            f'{span.text!r} cannot name a field: it is a keyword of C, C++ or Python',
            help=f'call it {span.text}_value, for example',
        )


def _snake_case(name: str) -> str:
    """Write a name as ROS does: `maxSpeed;` as `max_speed`."""
    spaced = re.sub(r'([a-z0-9])([A-Z])', r'\1_\2', name)
    return re.sub(r'_+', '_', re.sub(r'\W', '_', spaced)).strip('_').lower()


def _check_value(statement: Statement, span: Span) -> Iterator[Diagnostic]:
    rule = 'bad-constant' if statement.kind == 'constant' else 'bad-default'
    try:
        value = parse_value(statement.type.text, span.text)
    except DefinitionSyntaxError as error:
        yield diagnostic_at(span, rule, str(error))
        return
    if value == ():
        yield diagnostic_at(span, rule, 'an array is empty by default', help='leave out the []')
    for item in value if isinstance(value, tuple) else (value,):
        reason = _find_unwritable(statement.type.text, item)
        if reason:
            yield diagnostic_at(span, rule, reason)


def _find_unwritable(type_text: str, value: object) -> str | None:
    """Return why a valid value cannot be written into the generated code, or None."""
    if isinstance(value, float):
        if not math.isfinite(value):
            return 'a value must be finite: the generators cannot write infinity or NaN'
        if type_text.startswith('float32') and abs(value) > FLOAT32_MAX:
            return f'{value!r} is too great for a float32'
    if isinstance(value, str):
        if '\\' in value or not value.isprintable():
            return 'the text has a backslash or control character: the generators do not keep it'
        if type_text.endswith(']') and not value.isascii():
            return 'a text in an array has to be ASCII: the generators do not keep the rest'
    return None
