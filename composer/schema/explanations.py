"""An error of the JSON Schema validator → violations in the words of the language."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from composer.ament import ament_prefixes
from composer.schema.violations import (
    Violation,
    conflicting_keys,
    describe_types,
    droppable,
    missing_key,
    owner_of,
    path_of,
    show_value,
    wrong_type,
)
from composer.spelling import did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from jsonschema.exceptions import ValidationError


_KINDS = ('msg', 'srv', 'action')
_HELP_FOR_TYPES = "'composer interfaces list' shows the types"
# Of the file of a type: file systems take 255 bytes, with the ending.
_LONGEST_NAME = 200
_SEPARATORS = re.compile(r'[/.:]+')


# What launch files and other tools call the keys; the values may have other forms.
_OTHER_WORDS = {
    'action': ('send_goal',),
    'args': ('arguments', 'with'),
    'callback': ('behaviour',),
    'cmd': ('command',),
    'contains': ('text',),
    'depends_on': ('wait_for',),
    'duration': ('until',),
    'environment': ('env',),
    'equals': ('message',),
    'exec': ('executable',),
    'exec_name': ('name',),
    'freq': ('rate',),
    'frequency': ('rate',),
    'hz': ('rate',),
    'interval': ('period',),
    'max': ('maximum',),
    'min': ('minimum',),
    'msg': ('message',),
    'ns': ('namespace',),
    'params': ('parameters', 'set_parameters'),
    'params_file': ('parameter_files',),
    'pkg': ('package',),
    'pattern': ('matches',),
    'plugin': ('behaviour',),
    'queue': ('depth',),
    'regex': ('matches',),
    'remappings': ('remap',),
    'required': ('on_exit',),
    'respawn': ('restart',),
    'respawn_delay': ('restart',),
    'service': ('call',),
    'time': ('at',),
    'unless': ('when',),
    'if': ('when',),
    'working_dir': ('cwd',),
}


def explain(error: ValidationError) -> Iterator[Violation]:
    """Yield the violations behind an error: one for each unknown key of a mapping."""
    explanation = _EXPLANATIONS.get(str(error.validator), _explain_otherwise)
    return explanation(error)


def _explain_unknown_keys(error: ValidationError) -> Iterator[Violation]:
    schema = error.schema
    known = schema.get('properties', {})
    path = path_of(error)
    is_nested = _is_nested_parameter(error)
    for key in error.instance:
        if key in known or any(re.search(p, key) for p in schema.get('patternProperties', {})):
            continue
        same = next((each for each in _OTHER_WORDS.get(key, ()) if each in known), None)
        shown = show_value(error.instance[key])
        nested = f'write {path[-1]}.{key}: {shown}' if is_nested else None
        yield Violation(
            'unknown-key',
            f"unknown key '{key}'{owner_of(error)}",
            (*path, key),
            (*path, key),
            at_key=True,
            help=did_you_mean(same) or nested or suggest(key, known, 'the keys are'),
            meant=None if same else find_nearest(key, known),
        )


def _is_nested_parameter(error: ValidationError) -> bool:
    """Return whether a parameter is a mapping of others, as in parameter files."""
    known = {*error.schema.get('properties', {}), 'max', 'min'}
    is_parameter = error.schema.get('title') == 'parameter' and bool(error.instance)
    return is_parameter and not any(find_nearest(key, known) for key in error.instance)


def _explain_missing_keys(error: ValidationError) -> Iterator[Violation]:
    missing = [key for key in error.validator_value if key not in error.instance]
    # The validator reports each missing key on its own; its message begins with the key.
    key = next((key for key in missing if error.message.startswith(repr(key))), missing[0])
    yield missing_key(error, key, f"the key '{key}' is missing{owner_of(error)}")


def _explain_type(error: ValidationError) -> Iterator[Violation]:
    yield wrong_type(error, describe_types(error.validator_value))


def _explain_enum(error: ValidationError) -> Iterator[Violation]:
    options = [str(option) for option in error.validator_value]
    yield Violation(
        'bad-value',
        f'expected one of {", ".join(options)}; got {show_value(error.instance)}',
        path_of(error),
        droppable(path_of(error)),
        help=suggest(error.instance, options),
    )


def _explain_const(error: ValidationError) -> Iterator[Violation]:
    path = path_of(error)
    if path == ('version',):
        yield Violation(
            'unsupported-version',
            f'version {show_value(error.instance)} is not supported, only version 1',
            path,
            path,
            help='write 1 without quotes: a version is a number'
            if error.instance == str(error.validator_value)
            else None,
        )
        return
    yield Violation(
        'bad-value',
        f'expected {error.validator_value!r}, got {show_value(error.instance)}',
        path,
        droppable(path),
    )


def _explain_pattern(error: ValidationError) -> Iterator[Violation]:
    expected = error.schema.get('x-expected', f'text that matches {error.validator_value}')
    path = path_of(error)
    if _is_of_key(error):
        path = (*path, error.instance)
        message = f"'{error.instance}' is not {expected}"
        yield Violation('bad-value', message, path, path, at_key=True)
        return
    meant = _find_meant_form(error.instance, error.validator_value)
    is_name = error.instance.isidentifier() and re.search(
        '/(msg|srv|action)/', error.validator_value
    )
    yield Violation(
        'bad-value',
        f'expected {expected}; got {show_value(error.instance)}',
        path,
        droppable(path),
        help=did_you_mean(meant, _HELP_FOR_TYPES if is_name else None),
    )


def _is_of_key(error: ValidationError) -> bool:
    """Return whether a key is wrong: the path of the error is that of its mapping."""
    return 'propertyNames' in list(error.absolute_schema_path)[-2:-1]


_BOUNDS = {
    'minimum': 'at least',
    'maximum': 'at most',
    'exclusiveMinimum': 'more than',
    'minItems': 'at least',
    'maxItems': 'at most',
    'minLength': 'at least',
    'minProperties': 'at least',
}
_BOUND_UNITS = {
    'minItems': ' item',
    'maxItems': ' item',
    'minLength': ' character',
    'minProperties': ' key',
}


def _explain_bound(error: ValidationError) -> Iterator[Violation]:
    keyword = str(error.validator)
    path = path_of(error)
    limit = f'{error.validator_value:.9f}'.rstrip('0').rstrip('.')
    unit = _BOUND_UNITS.get(keyword, '')
    plural = 's' if unit and error.validator_value != 1 else ''
    is_list = isinstance(error.instance, list) and error.instance
    found = f'{len(error.instance)}' if is_list else show_value(error.instance)
    yield Violation(
        'out-of-range',
        f'expected {_BOUNDS[keyword]} {limit}{unit}{plural}, got {found}',
        path,
        droppable(path),
        help='write 1' if path[-1] in ('depth', 'qos') and keyword == 'minimum' else None,
    )


def _explain_dependency(error: ValidationError) -> Iterator[Violation]:
    path = path_of(error)
    for key, needed in error.validator_value.items():
        for other in needed:
            if key in error.instance and other not in error.instance:
                yield Violation(
                    'missing-key',
                    f"'{key}' requires '{other}'",
                    (*path, key),
                    (*path, key),
                    at_key=True,
                )


def _explain_exclusion(error: ValidationError) -> Iterator[Violation]:
    if not isinstance(error.instance, dict):
        return
    excluded = error.validator_value
    for each in excluded.get('anyOf', [excluded]):
        if all(key in error.instance for key in each['required']):
            yield conflicting_keys(error, each['required'])


def _explain_alternatives(error: ValidationError) -> Iterator[Violation]:
    branches = error.validator_value
    if all('required' in branch and 'type' not in branch for branch in branches):
        if not isinstance(error.instance, dict):
            return  # its type has a finding of its own
        if _is_nested_parameter(error):
            return  # its keys have findings of their own
        yield _explain_key_alternatives(error, [branch['required'] for branch in branches])
        return
    by_branch: dict[int, list[ValidationError]] = {}
    for inner in error.context or ():
        by_branch.setdefault(int(inner.schema_path[0]), []).append(inner)
    expected = []
    for inner_errors in by_branch.values():
        mismatch = next((e for e in inner_errors if _is_mismatch(e, error)), None)
        if mismatch is None:
            for inner in inner_errors:
                yield from explain(inner)
            return
        if not str(mismatch.schema.get('title')).endswith('by parameter'):
            expected.append(_describe_mismatch(mismatch))
    yield wrong_type(error, ' or '.join(dict.fromkeys(expected)))


def _is_mismatch(inner: ValidationError, outer: ValidationError) -> bool:
    """Return whether a value cannot have been meant as an alternative."""
    if inner.absolute_path != outer.absolute_path:
        return False
    if inner.validator == 'const':
        return True
    # Without a context, several of the alternatives hold.
    context = inner.context if inner.validator == 'oneOf' else None
    nested = bool(context) and all(_is_mismatch(e, outer) for e in context or ())
    return inner.validator == 'type' or nested


def _describe_mismatch(error: ValidationError) -> str:
    if error.validator == 'const':
        value = error.validator_value
        return show_value(value) if isinstance(value, bool) else repr(value)
    if error.validator == 'oneOf':
        return ' or '.join(_describe_mismatch(inner) for inner in error.context or ())
    return describe_types(error.validator_value)


def _explain_key_alternatives(error: ValidationError, alternatives: list[list[str]]) -> Violation:
    present = [keys for keys in alternatives if all(key in error.instance for key in keys)]
    if len(present) > 1:
        return conflicting_keys(error, [keys[0] for keys in present])
    absent = [[key for key in keys if key not in error.instance] for keys in alternatives]
    wanted = ' or '.join(' and '.join(f"'{key}'" for key in keys) for keys in absent)
    verb = 'is' if all(len(keys) == 1 for keys in absent) else 'are'
    first = alternatives[0][0]
    return missing_key(error, first, f'{wanted} {verb} missing{owner_of(error)}')


def _explain_otherwise(error: ValidationError) -> Iterator[Violation]:
    path = path_of(error)
    yield Violation('bad-value', error.message, path, droppable(path))


def _find_meant_form(text: str, pattern: str) -> str | None:
    """Return a text in the form that a pattern of the schema wants, or `None`.

    Types as other places write them: `std_msgs/String` (ROS 1), `std_msgs.msg.String` (Python),
    `std_msgs::msg::String` (C++); behaviours with a dot, slashes, dashes, `.py` or `()` in them.
    """
    kind = next((kind for kind in _KINDS if f'/{kind}/' in pattern), None)
    form = _as_type(text, kind) if kind else _as_behaviour(text)
    return form if re.search(pattern, form) and form != text else None


def _as_type(text: str, kind: str) -> str:
    if re.fullmatch(rf'({kind}/)?\w+', text):
        return _find_type(text.removeprefix(f'{kind}/'), kind)
    package, *middle, name = [*_SEPARATORS.split(text.strip()), '']
    name = middle.pop() if middle else name
    is_other = any(part in _KINDS and part != kind for part in middle)
    return '' if is_other or len(middle) > 1 else f'{package}/{kind}/{name}'


def _find_type(name: str, kind: str) -> str:
    """Return the full name of a type that an installed package has; empty if none has."""
    if not (name.isascii() and len(name) < _LONGEST_NAME):
        return ''
    prefixes = ament_prefixes()
    files = (path for each in prefixes for path in each.glob(f'share/*/{kind}/{name}.{kind}'))
    packages = sorted(path.parts[-3] for path in files)
    # Others have copies of the standard ones.
    packages.sort(key=lambda each: not each.startswith('std_'))
    return f'{packages[0]}/{kind}/{name}' if packages else ''


def _as_behaviour(text: str) -> str:
    plain = text.strip().removesuffix('()').replace('-', '_').replace('::', ':')
    module, _, function = plain.rpartition(':')
    if not module:
        module, _, function = function.rpartition('.')
    return f'{module.removesuffix(".py").replace("/", ".")}:{function}'


_EXPLANATIONS: dict[str, Callable[[ValidationError], Iterator[Violation]]] = {
    'additionalProperties': _explain_unknown_keys,
    'required': _explain_missing_keys,
    'type': _explain_type,
    'enum': _explain_enum,
    'const': _explain_const,
    'pattern': _explain_pattern,
    'dependentRequired': _explain_dependency,
    'not': _explain_exclusion,
    'oneOf': _explain_alternatives,
    'anyOf': _explain_alternatives,
    **dict.fromkeys(_BOUNDS, _explain_bound),
}
