"""ROS's rules for names.

Sources: https://design.ros2.org/articles/topic_and_service_names.html and the validation in rmw
(`validate_node_name.c`, `validate_namespace.c`) and rcl (`validate_topic_name.c`, `remap.c`).
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

# RMW_NODE_NAME_MAX_NAME_LENGTH, RMW_NAMESPACE_MAX_LENGTH, RMW_TOPIC_MAX_NAME_LENGTH
MAX_NODE_NAME = 255
MAX_NAMESPACE = 245
MAX_TOPIC_NAME = 247

_NODE_CHARACTERS = re.compile(r'[A-Za-z0-9_]*')
_TOPIC_CHARACTERS = re.compile(r'[A-Za-z0-9_/~{}]*')
_FULL_CHARACTERS = re.compile(r'[A-Za-z0-9_/]*')
# Most names: what is left has all other rules to pass.
_ORDINARY = re.compile(r'(?:~?/)?[A-Za-z_][A-Za-z0-9_]*(?:/[A-Za-z_][A-Za-z0-9_]*)*')
_SUBSTITUTION = re.compile(r'\{([^{}]*)\}')
_SUBSTITUTIONS = ('node', 'ns', 'namespace')


def with_article(noun: str) -> str:
    """Return `a timer`, `an action`."""
    return f'an {noun}' if noun[0] in 'aeiou' else f'a {noun}'


def count_of(number: int, noun: str) -> str:
    """Return `1 node`, `2 nodes`, `2 processes`."""
    plural = f'{noun}es' if noun.endswith('s') else f'{noun}s'
    return f'{number} {noun if number == 1 else plural}'


def find_node_name_problem(name: str) -> str | None:
    """Return why `name` cannot name a node, or `None` if it can."""
    if not name:
        return 'a node name is not empty'
    if not _NODE_CHARACTERS.fullmatch(name):
        return 'a node name has only letters, digits and underscores'
    if name[0].isdigit():
        return 'a node name does not begin with a digit'
    if len(name) > MAX_NODE_NAME:
        return f'a node name has at most {MAX_NODE_NAME} characters'
    return None


def find_namespace_problem(namespace: str) -> str | None:
    """Return why `namespace` (absolute or relative) cannot be one, or `None` if it can."""
    full = namespace if namespace.startswith('/') else f'/{namespace}'
    if full == '/':
        return None
    if not _FULL_CHARACTERS.fullmatch(full):
        return 'a namespace has only letters, digits, underscores and slashes'
    if full.endswith('/'):
        return 'a namespace does not end with a slash'
    return _find_token_problem('a namespace', full, MAX_NAMESPACE)


def find_topic_name_problem(name: str, kind: str = 'topic') -> str | None:
    """Return why `name` cannot name a topic, service or action, or `None` if it can.

    Relative, absolute (`/x`) and private (`~/x`) names, and rcl's substitutions, as in `{node}`.
    """
    if len(name) <= MAX_TOPIC_NAME and _ORDINARY.fullmatch(name):
        return None
    what = with_article(f'{kind} name')
    if not name:
        return f'{what} is not empty'
    if not _TOPIC_CHARACTERS.fullmatch(name):
        return f"{what} has only letters, digits, underscores, slashes, and '~/' first"
    if name.endswith('/'):
        return f'{what} does not end with a slash'
    if '~' in name[1:] or (name[0] == '~' and len(name) > 1 and name[1] != '/'):
        return f"'~' is only allowed at the start of {what}, before a slash"
    plain = _SUBSTITUTION.sub('x', name)
    if '{' in plain or '}' in plain:
        return f'{what} has a brace without its partner'
    for substitution in _SUBSTITUTION.findall(name):
        if substitution not in _SUBSTITUTIONS:
            return (
                f"'{{{substitution}}}' is no substitution of ROS: {{node}}, {{ns}}, {{namespace}}"
            )
    return _find_token_problem(what, plain.removeprefix('~'), MAX_TOPIC_NAME)


def find_parameter_name_problem(name: str) -> str | None:
    """Return why `name` cannot name a parameter, or `None` if it can."""
    if not name:
        return 'a parameter name is not empty'
    if any(not part for part in name.split('.')):
        return 'a parameter name has no empty part between its dots'
    if any(character.isspace() for character in name):
        return 'a parameter name has no spaces'
    return None


def expand_namespace(namespace: str, default: str = '/') -> str:
    """Return a namespace in full; a relative one lies in `default`."""
    if namespace.startswith('/'):
        return namespace
    return join_names(default, namespace) if namespace else default


def join_names(namespace: str, name: str) -> str:
    """Return `name` in `namespace`, which begins with a slash."""
    return f'/{name}' if namespace == '/' else f'{namespace}/{name}'


def split_name(full_name: str) -> tuple[str, str]:
    """Return the namespace and the name of a full name."""
    namespace, _, name = full_name.rpartition('/')
    return namespace or '/', name


def expand_name(name: str, node_name: str, namespace: str) -> str:
    """Return a topic, service or action name in full, as `rcl_expand_topic_name` does."""
    if '{' in name:
        for key, value in (('node', node_name), ('ns', namespace), ('namespace', namespace)):
            name = name.replace(f'{{{key}}}', value)
    if name.startswith('~'):
        return join_names(namespace, node_name) + name[1:]
    if name.startswith('/'):
        return name
    return join_names(namespace, name)


def remap_name(
    name: str, rules: Sequence[tuple[str, str]], node_name: str, namespace: str, scheme: str
) -> str:
    """Return what the node's remapping rules make of a full name; the first that matches wins.

    Args:
        name: As `expand_name` returned it.
        rules: Pairs of from and to, both relative, absolute or private.
        scheme: `rostopic` or `rosservice`: rules that begin with the other one do not apply.
    """
    for source, target in rules:
        prefix, separator, bare = source.rpartition('://')
        if separator and prefix != scheme:
            continue
        if expand_name(bare, node_name, namespace) == name:
            return expand_name(target, node_name, namespace)
    return name


def _find_token_problem(what: str, full: str, limit: int) -> str | None:
    if '//' in full:
        return f'{what} has no two slashes in a row'
    if any(token[:1].isdigit() for token in full.split('/')):
        return f'no part of {what} begins with a digit'
    if len(full) > limit:
        return f'{what} has at most {limit} characters'
    return None
