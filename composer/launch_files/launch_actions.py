"""A system in a launch file, and a system that `ros2 launch` starts.

`launch` finds what is here by the entry points of this package: `composer` is an action in XML and
YAML, and `robot.composer.yaml` is a launch file. In Python:

    from composer.launch_files.launch_actions import ComposerSystem

    ComposerSystem(file='robot.yaml', arguments={'side': LaunchConfiguration('side')})

The system runs in a process of its own, which is started, stopped, respawned and logged as those
of other actions. Only `launch` imports this module.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import launch_yaml
from launch import Substitution, frontend
from launch.actions import ExecuteProcess
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions

from composer.language.pipeline import load_system

if TYPE_CHECKING:
    from collections.abc import Mapping

_SUFFIXES = ('composer.yaml', 'composer.yml')
# The default of an argument whose value the file computes.
_OF_FILE = '(as the file says)'
# A stop of a system takes its own time: behaviours and processes end first.
_STOP_SEC = '20'


@frontend.expose_action('composer')
class ComposerSystem(ExecuteProcess):
    """Runs a system, as `composer up FILE NAME:=VALUE…` does.

    Args:
        file: The file, a text or substitutions; relative to the working folder.
        arguments: Values for its arguments: texts or substitutions, by name.
        options: More of `ExecuteProcess`, as `respawn` and `on_exit`.
    """

    def __init__(
        self, *, file: Any, arguments: Mapping[str, Any] | None = None, **options: Any
    ) -> None:
        given = {
            name: normalize_to_list_of_substitutions(value)
            for name, value in (arguments or {}).items()
        }
        words = [[f'{name}:=', *value] for name, value in given.items()]
        command = [sys.executable, '-m', 'composer', 'up', [_File(file, given)], *words]
        options.setdefault('name', 'composer')
        options.setdefault('output', 'screen')
        options.setdefault('sigterm_timeout', _STOP_SEC)
        super().__init__(cmd=command, **options)

    def prepare(self, context: Any) -> None:
        """Resolve the command; the file itself computes what nobody has given."""
        super().prepare(context)
        words = self.process_description.final_cmd
        words[:] = [word for word in words if not word.endswith(f':={_OF_FILE}')]

    @classmethod
    def parse(cls, entity: Any, parser: Any, ignore: Any = None) -> Any:
        """Return the class and its arguments, as read from XML or YAML."""
        _, options = super().parse(entity, parser, ['cmd', *(ignore or ())])
        options['file'] = parser.parse_substitution(entity.get_attr('file'))
        given = entity.get_attr('arg', data_type=list[frontend.Entity], optional=True) or ()
        options['arguments'] = {
            parser.escape_characters(each.get_attr('name')): parser.parse_substitution(
                each.get_attr('value')
            )
            for each in given
        }
        for each in given:
            each.assert_entity_completely_parsed()
        return cls, options


class _File(Substitution):
    """The file of a system; its description names the nodes, as far as they are known."""

    def __init__(self, file: Any, given: Mapping[str, list[Any]]) -> None:
        super().__init__()
        self._parts = normalize_to_list_of_substitutions(file)
        self._given = given

    def perform(self, context: Any) -> str:
        return str(perform_substitutions(context, self._parts))

    def describe(self) -> str:
        texts = [getattr(each, 'text', None) for each in self._parts]
        shown = ' + '.join(each.describe() for each in self._parts)
        if None in texts or not os.path.isfile(''.join(map(str, texts))):
            return shown
        spec = load_system(Path(''.join(map(str, texts)))).spec
        names = [] if spec is None else [node.full_name for node in spec.nodes.values()]
        processes = () if spec is None else spec.processes.values()
        names += [
            name
            for each in processes
            for name in (each.named_nodes or [node.full_name for node in each.nodes])
        ]
        return f'{shown} (nodes: {", ".join(names)})' if names else shown


class Parser(frontend.Parser):
    """Reads a system as a launch file: its arguments, and the action that runs it."""

    @classmethod
    def load(cls, file: Any) -> Any:
        """Return the description of a launch file that runs a system.

        Raises:
            ValueError: It is no system, or cannot be read; `launch` then asks other parsers.
        """
        path = Path(file if isinstance(file, str | os.PathLike) else file.name).absolute()
        system = load_system(path)
        if system.data is None or 'version' not in system.data:
            message = f'{path} is no system of Composer'
            raise ValueError(message)
        declared, given = [], []
        for name, argument in system.arguments.items():
            entry: dict[str, Any] = {'name': name}
            if argument.is_computed:
                entry['default'] = _OF_FILE
            elif argument.default is not None:
                entry['default'] = _escaped(_written(argument.default))
            if argument.description:
                entry['description'] = argument.description
            if argument.choices:
                entry['choice'] = [{'value': _written(each)} for each in argument.choices]
            declared.append({'arg': entry})
            given.append({'name': name, 'value': f'$(var {name})'})
        action = {'file': _escaped(str(path))} | ({'arg': given} if given else {})
        return launch_yaml.Entity(
            [*declared, {'composer': action}], 'launch'
        ), launch_yaml.Parser()

    @classmethod
    def get_file_extensions(cls) -> set[str]:
        """Return the ends of names that are systems without doubt."""
        return set(_SUFFIXES)


def _written(value: Any) -> str:
    """Return a value as on a command line."""
    return value if isinstance(value, str) else json.dumps(value)


def _escaped(text: str) -> str:
    """Return a text that `launch` takes as it is."""
    return text.replace('\\', '\\\\').replace('$', '\\$')
