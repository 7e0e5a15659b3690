"""A system as a folder of stubs: its messages, what payloads may be, and its nodes."""

from __future__ import annotations

import keyword
import re
from importlib import resources
from typing import TYPE_CHECKING

from composer.stubs.checking.annotated_copies import find_certain_values, find_received_values
from composer.stubs.message_stubs import SUPPORT, write_packages
from composer.stubs.node_stubs import shape_of, write_nodes
from composer.stubs.project_modules import all_nodes, find_project_modules, reach_of
from composer.stubs.stored_types import find_stored_types

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from composer.checks.context import CheckContext
    from composer.language.specs import NodeSpec
    from composer.node_uses.reading import CreatedEntity
    from composer.stubs.node_stubs import NodeShape
    from composer.stubs.project_modules import ProjectModule
    from composer.stubs.stored_types import StoredTypes

HEADER = '# Written by `composer stubs`: changes are lost the next time.'


def stubs_of(context: CheckContext) -> dict[str, str]:
    """Return the stubs of a system, by their paths in the folder of stubs."""
    modules = find_project_modules(context)
    module = module_of(context)
    given = find_certain_values(find_received_values(context, modules))
    stored = find_stored_types(context, modules, given)
    classes = name_classes(shapes_of(context, modules, stored))
    files = dict(write_messages(context, modules))
    # No `.pyi`: pyright warns of a stub without a module, and here there is none.
    files[f'{SUPPORT}/{module}.py'] = text_of(write_nodes(f'{SUPPORT}.{module}', classes))
    return files


def write_messages(
    context: CheckContext, modules: Mapping[str, ProjectModule]
) -> Iterator[tuple[str, str]]:
    """Yield the stubs of what all systems share, and of the messages of one, with their paths."""
    yield f'{SUPPORT}/__init__.pyi', f'{HEADER}\n{read_template("composer_stubs.pyi")}'
    yield f'{SUPPORT}/payloads/__init__.pyi', text_of([])
    packages = {
        end.type.partition('/')[0]
        for node in all_nodes(context)
        for end in (*(end for _, end in node.ends()), *_created(context, node))
        if end.type
    }
    for module in modules.values():
        packages |= {name.partition('.')[0] for name in module.imports}
    packages &= {*context.catalogue.packages()}
    stubs = write_packages(sorted(packages), context.catalogue)
    yield from ((path, text_of(lines)) for path, lines in stubs)


def read_template(name: str) -> str:
    """Return the text of a stub that is the same for all systems."""
    return (resources.files('composer') / 'stubs' / 'shared' / name).read_text(encoding='utf-8')


def stand_ins(qos_profiles: Iterable[str] = ()) -> dict[str, str]:
    """Return the stubs of what behaviours use of Composer and rclpy, in place of the packages."""
    names = ''.join(f'{name!r}, ' for name in qos_profiles)
    composer = read_template('composer.pyi').replace('Literal[', f'Literal[{names}', 1)
    return {
        'composer/__init__.pyi': composer,
        'rclpy/__init__.pyi': 'from typing import Any\ndef __getattr__(name: str) -> Any: ...\n',
        'rclpy/time.pyi': read_template('rclpy_time.pyi'),
        'rclpy/duration.pyi': read_template('rclpy_duration.pyi'),
    }


def text_of(lines: Iterable[str]) -> str:
    """Return the text of a stub."""
    return '\n'.join([HEADER, *lines, ''])


def module_of(context: CheckContext) -> str:
    """Return the name of the module with a system's nodes: that of its file."""
    name = re.sub(r'\W', '_', context.system.path.stem)
    is_free = name.isidentifier() and not keyword.iskeyword(name) and name != 'payloads'
    return name if is_free else f'system_{name}'


def shapes_of(
    context: CheckContext,
    modules: Mapping[str, ProjectModule],
    stored: Mapping[str, StoredTypes],
) -> dict[str, NodeShape]:
    """Return the shapes of a system's nodes, by their keys in the file."""
    return {
        node.key: shape_of(
            node, [stored[each] for each in reach_of(node, modules)], _created(context, node)
        )
        for node in all_nodes(context)
    }


def _created(context: CheckContext, node: NodeSpec) -> list[CreatedEntity]:
    return [created for reading in context.readings(node) for created in reading.created]


def name_classes(shapes: Mapping[str, NodeShape]) -> dict[str, NodeShape]:
    """Return shapes by the names of their classes: `Governor` for a node `governor`."""
    named: dict[str, NodeShape] = {}
    for key, shape in shapes.items():
        name = class_name(key)
        if name in named:
            name = f'{name}_{len(named)}'
        named[name] = shape
    return named


def class_name(key: str) -> str:
    """Return the name of the class of a node, by its key in the file."""
    words = re.split(r'[^0-9a-zA-Z]+', key)
    name = ''.join(word[:1].upper() + word[1:] for word in words)
    return name if name.isidentifier() and not keyword.iskeyword(name) else f'Node{name}'
