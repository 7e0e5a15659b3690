"""Declared nodes → NoDL documents."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

from composer.entity_kinds import KIND_OF_SECTION
from composer.language.nodl.yaml_documents import DURATION_KEYS, SECTIONS
from composer.language.qos import BUILTIN_PROFILES, DEFAULT_PROFILE, NANOSECONDS
from composer.ros_parameters.parameter_types import infer_parameter_type
from composer.yaml_text.writer import COMPOSER, render_yaml

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_DIALECT = replace(COMPOSER, has_expressions=False)
_LIMITS = {'minimum': 'gt_eq<>', 'maximum': 'lt_eq<>'}


def render_nodl(node: Mapping[str, Any]) -> str:
    """Return the document of a node in YAML, version 2.

    Args:
        node: Its sections, as a declared node has them in the language.
    """
    document: dict[str, Any] = {'nodl_version': 2}
    if 'parameters' in node:
        document['parameters'] = {
            name: _parameter(each) for name, each in node['parameters'].items()
        }
    for key, section in SECTIONS.items():
        ends = [_end(section, name, entry) for name, entry in node.get(section, {}).items()]
        if ends:
            document[key] = ends
    return render_yaml(document, _DIALECT)


def _end(section: str, name: str, entry: str | Mapping[str, Any]) -> dict[str, Any]:
    channel = str(KIND_OF_SECTION[section].channel)
    data: Mapping[str, Any] = {'type': entry} if isinstance(entry, str) else entry
    found: dict[str, Any] = {'name': data.get(channel, name), 'type': data['type']}
    if channel == 'topic':
        found['qos'] = dict(_policies(data.get('qos', {})))
    return found


def _policies(qos: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    # What is in neither may be unknown: middlewares tell others nothing of it.
    is_told = not qos.keys().isdisjoint(('history', 'depth'))
    whole = {**BUILTIN_PROFILES[DEFAULT_PROFILE], 'liveliness': 'automatic', **qos}
    for policy, value in whole.items():
        if policy in DURATION_KEYS:
            yield f'{policy}_ns', round(value * NANOSECONDS)
        elif policy not in ('history', 'depth') or (
            is_told and (policy == 'history' or whole['history'] == 'keep_last')
        ):
            yield policy, value.upper() if isinstance(value, str) else value


def _parameter(declared: Any) -> dict[str, Any]:
    data = declared if isinstance(declared, dict) else {'default': declared}
    kind = data.get('type') or infer_parameter_type(data['default']) or 'string_array'
    found: dict[str, Any] = {'type': kind.replace('integer', 'int')}
    if 'default' in data:
        found['default_value'] = data['default']
    found |= {key: data[key] for key in ('description', 'read_only') if key in data}
    limits = {rule: [data[key]] for key, rule in _LIMITS.items() if key in data}
    return found | ({'validation': limits} if limits else {})


def render_nodl_xml(nodes: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the document of nodes in XML, version 1, which has no QoS.

    Args:
        nodes: Their sections, as declared nodes have them in the language, by their names.
    """
    lines = ['<interface version="1">']
    for name, node in nodes.items():
        lines.append(f'  <node name={quoteattr(name)} executable={quoteattr(name)}>')
        lines += [f'    {each}' for each in _elements(node)]
        lines.append('  </node>')
    return '\n'.join([*lines, '</interface>', ''])


def _elements(node: Mapping[str, Any]) -> Iterator[str]:
    for section in SECTIONS.values():
        kind = KIND_OF_SECTION[section]
        role = kind.noun if kind.channel == 'topic' else 'server' if kind.provides else 'client'
        for name, entry in node.get(section, {}).items():
            data = {'type': entry} if isinstance(entry, str) else entry
            attributes = {
                'name': data.get(str(kind.channel), name),
                'type': data['type'],
                'role': role,
            }
            yield _element(str(kind.channel), attributes)
    for name, declared in node.get('parameters', {}).items():
        yield _element('parameter', {'name': name, 'type': _parameter(declared)['type']})


def _element(tag: str, attributes: Mapping[str, str]) -> str:
    written = ' '.join(f'{key}={quoteattr(value)}' for key, value in attributes.items())
    return f'<{tag} {written} />'
