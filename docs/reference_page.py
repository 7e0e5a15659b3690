"""Generate the reference of every key from the schema."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import yaml

from composer.entity_kinds import ENTITY_KINDS
from composer.names import with_article

if TYPE_CHECKING:
    from collections.abc import Iterator

_TEMPLATE = {'$ref': '#/$defs/template'}
# The objects in the order of a file, then what they refer to.
_TITLES = {
    'node': 'A node',
    **{
        kind.noun.replace(' ', '_'): with_article(kind.noun).capitalize()
        for kind in (*ENTITY_KINDS[1:], ENTITY_KINDS[0])
    },
    'hook': 'A behaviour',
    'interface_package': 'An interface package',
    'argument': 'An argument',
    'include': 'An include',
    'combination': 'A combination to check',
    'foreach': 'Variables of foreach',
    'value_by_parameter': 'A value by parameter',
    'number_by_parameter': 'A number by parameter',
    'text_by_parameter': 'A text by parameter',
    'process': 'An external process',
    'process_restart': 'A restart policy',
    'process_stop': 'A stop policy',
    'condition': 'A condition',
    'worker': 'A worker',
    'host': 'A host',
    'network': 'The network',
    'system': 'The system',
    'case': 'A case',
    'given': 'What is given',
    'service_stand_in': 'A stand-in for a service',
    'action_stand_in': 'A stand-in for an action',
    'feedback': 'Feedback of a stand-in',
    'step': 'A step',
    'expectation': 'An expectation',
    'pattern': 'A message of an order',
    'qos': 'QoS',
    'qos_profile': 'A QoS profile',
}
_TYPE_WORDS = {
    'object': 'mapping',
    'array': 'list',
    'string': 'string',
    'number': 'number',
    'integer': 'integer',
    'boolean': 'boolean',
}


def reference_page(schema: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of the reference of system files.

    Args:
        schema: Their JSON Schema.
    """
    yield '# Reference'
    yield ''
    yield 'Every key of a file. Generated from `schemas/composer.schema.json` by `make docs`.'
    yield ''
    yield 'Any scalar can be an expression, in quotes: `"{{ name }}"`.'
    yield from _sections(schema)


def scenario_reference_page(schema: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of the reference of scenario files.

    Args:
        schema: Their JSON Schema.
    """
    yield '# Reference of scenario files'
    yield ''
    yield 'Every key. Generated from `schemas/scenario.schema.json` by `make docs`.'
    yield 'Times are seconds since the start of the system, unless a key says otherwise.'
    yield from _sections(schema)


def _sections(schema: dict[str, Any]) -> Iterator[str]:
    yield ''
    yield '## A file'
    yield ''
    yield schema['description']
    yield from _table(schema, schema)
    yield from _example(schema)
    for name, key in schema['properties'].items():
        if 'properties' in key:
            yield from _section(f'`{name}`', key, schema)
    sections = {**_TITLES, **{name: name for name in _undescribed(schema)}}
    for name, title in sections.items():
        if name in schema['$defs']:
            yield from _section(title, schema['$defs'][name], schema)


def _undescribed(schema: dict[str, Any]) -> list[str]:
    """Return the definitions with keys that have no title in `_TITLES`."""
    return [
        name
        for name, definition in schema['$defs'].items()
        if name not in _TITLES and _object_of(definition)
    ]


def _section(title: str, definition: dict[str, Any], schema: dict[str, Any]) -> Iterator[str]:
    yield ''
    yield f'## {title}'
    yield ''
    if 'description' in definition:
        yield definition['description']
    forms = [
        form
        for form in definition.get('oneOf', ())
        if 'properties' not in form and set(form) != {'required'}
    ]
    if forms:
        yield ''
        yield f'Short form: {_join(_describe(form, schema) for form in forms)}.'
    owner = _object_of(definition)
    if owner:
        yield from _table(owner, schema)
    yield from _example(definition)


def _object_of(definition: dict[str, Any]) -> dict[str, Any] | None:
    if 'properties' in definition:
        return definition
    forms = definition.get('oneOf', ())
    return next((form for form in forms if 'properties' in form), None)


def _table(owner: dict[str, Any], schema: dict[str, Any]) -> Iterator[str]:
    yield ''
    yield '| key | type | default | meaning |'
    yield '|---|---|---|---|'
    for key, value in owner['properties'].items():
        meaning, default = _split_default(_meaning(value, schema))
        if key in owner.get('required', ()):
            default = 'required'
        cells = (f'`{key}`', _describe(value, schema), default, meaning)
        yield f'| {" | ".join(_cell(cell) for cell in cells)} |'
    for pattern, value in owner.get('patternProperties', {}).items():
        yield f'| `{pattern.removeprefix("^")}…` | anything |  | {value["description"]} |'
    for group in [owner, *filter(None, [owner.get('else')]), *owner.get('allOf', ())]:
        for text in _conditions(group):
            yield ''
            yield text


def _conditions(owner: dict[str, Any]) -> Iterator[str]:
    for word, keyword in (('Exactly one', 'oneOf'), ('At least one', 'anyOf')):
        branches = owner.get(keyword, ())
        if branches and all('required' in each and 'type' not in each for each in branches):
            listed = _join(
                ' with '.join(f'`{key}`' for key in branch['required']) for branch in branches
            )
            yield f'{word} of {listed} is required.'
    for key, needed in owner.get('dependentRequired', {}).items():
        yield f'`{key}` requires {" and ".join(f"`{other}`" for other in needed)}.'
    excluded = owner.get('not', {}).get('required')
    if excluded:
        yield f'{" and ".join(f"`{key}`" for key in excluded)} cannot be used together.'


def _meaning(value: dict[str, Any], schema: dict[str, Any]) -> str:
    if 'description' in value:
        return str(value['description'])
    return str(_resolve(value, schema).get('description', ''))


def _split_default(text: str) -> tuple[str, str]:
    """Take `Default: 8.` from the end of a description."""
    meaning, found, default = text.partition(' Default: ')
    return meaning, f'`{default.rstrip(".")}`' if found else ''


def _resolve(value: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    while '$ref' in value:
        value = schema['$defs'][value['$ref'].rpartition('/')[2]]
    return value


def _describe(value: dict[str, Any], schema: dict[str, Any]) -> str:
    """Return the type of a value in words, with a link if it has a section."""
    name = value.get('$ref', '').rpartition('/')[2]
    if name in _TITLES:
        title = _TITLES[name]
        anchor = title.lower().replace(' ', '-')
        return f'[{title[0].lower() + title[1:] if title != "QoS" else title}](#{anchor})'
    value = _resolve(value, schema)
    for keyword in ('oneOf', 'anyOf'):
        branches = [branch for branch in value.get(keyword, ()) if branch != _TEMPLATE]
        if branches and not any(set(branch) == {'required'} for branch in branches):
            return _join(dict.fromkeys(_describe(branch, schema) for branch in branches))
    if 'enum' in value:
        return _join(f'`{option}`' for option in value['enum'])
    if 'const' in value:
        return f'`{json.dumps(value["const"])}`'
    if 'x-expected' in value:
        return str(value['x-expected'])
    return _describe_type(value, schema)


def _describe_type(value: dict[str, Any], schema: dict[str, Any]) -> str:
    types = value.get('type', 'anything')
    text = _join(
        _TYPE_WORDS.get(each, each) for each in ([types] if isinstance(types, str) else types)
    )
    if types == 'object' and isinstance(value.get('additionalProperties'), dict):
        return f'mapping of names to {_describe(value["additionalProperties"], schema)}'
    if types == 'array' and 'items' in value:
        return f'list of {_describe(value["items"], schema)}'
    bounds = []
    for keyword, words in (('minimum', 'from'), ('exclusiveMinimum', 'above'), ('maximum', 'to')):
        if keyword in value and abs(value[keyword]) < 2**31 - 1:
            bounds.append(f'{words} {value[keyword]:.9f}'.rstrip('0').rstrip('.'))
    return f'{text} {" ".join(bounds)}' if bounds else text


def _example(definition: dict[str, Any]) -> Iterator[str]:
    snippets = (each['body'] for each in definition.get('defaultSnippets', ()))
    for example in (*definition.get('examples', ()), *snippets):
        yield ''
        yield '```yaml'
        yield from _as_yaml(example).splitlines()
        yield '```'


def _as_yaml(example: Any) -> str:
    """Return an example as YAML, with small mappings on one line."""
    if not isinstance(example, dict):
        return str(example)
    return yaml.dump(example, Dumper=_Dumper, sort_keys=False, width=200, default_flow_style=None)


class _Dumper(yaml.SafeDumper):
    """Writes only small mappings in braces."""

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:  # noqa: ARG002, FBT001, FBT002
        super().increase_indent(flow, indentless=False)


def _join(words: Any) -> str:
    listed = list(words)
    return ', '.join(listed[:-1]) + ' or ' + listed[-1] if len(listed) > 1 else ''.join(listed)


def _cell(text: str) -> str:
    return text.replace('|', '\\|').replace('\n', ' ')
