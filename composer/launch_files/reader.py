"""A launch description → the entries of a system.

The description is walked as `launch` would run it, with expressions in place of arguments. Its
objects are recognised by the names of their classes.
"""

from __future__ import annotations

import os
import re
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.expressions import is_variable_name
from composer.launch_files.opaque import OpaqueRuns
from composer.launch_files.parameters import ParameterReader
from composer.launch_files.programs import ProgramReader
from composer.launch_files.scope import Condition, Scope, Wait
from composer.launch_files.substitutions import (
    LaunchError,
    Resolver,
    class_names,
    private,
    truth_of,
)
from composer.launch_files.texts import Computed, Text, chosen, joined, one

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.launch_files.loading import Loader

# A launch file that includes itself would never end.
_DEEPEST = 40


@dataclass
class Argument:
    """A launch argument; all are texts.

    Attributes:
        default: `None` if a value is required.
        fixed: Whether functions of the launch file depend on its value, so that it cannot change.
    """

    name: str
    default: Text | None
    description: str
    choices: tuple[str, ...]
    given: str | None = None
    fixed: bool = False


@dataclass
class Entry:
    """A process of the system.

    Attributes:
        section: `processes` or `containers`.
        action: The object of `launch` that it is made of.
        remarks: What could not be kept of it.
    """

    section: str
    name: str
    data: dict[str, Any]
    action: Any
    origin: str
    when: str
    holds: bool
    waits: list[Wait]
    environment: dict[str, Text | None]
    remarks: list[str] = field(default_factory=list)


@dataclass
class Imported:
    """What a launch file consists of."""

    arguments: dict[str, Argument] = field(default_factory=dict)
    entries: list[Entry] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)


class DescriptionReader:
    """Walks a launch description.

    Args:
        given: The arguments that the import was given.
    """

    def __init__(self, loader: Loader, given: dict[str, str]) -> None:
        self.loader = loader
        self.given = given
        self.scope = Scope()
        self.result = Imported()
        # Files of before are not written by the launch file.
        self.started = time.time()
        self._depth = 0
        self._programs = ProgramReader(self)
        self._opaque = OpaqueRuns(self)
        self.origin = ''

    @property
    def resolver(self) -> Resolver:
        """Resolves substitutions here."""
        return Resolver(self)

    def remark(self, text: str) -> None:
        """Note what cannot be kept, with the line that it comes from."""
        remark = f'{self.origin}: {text}' if self.origin else text
        if remark not in self.result.remarks:
            self.result.remarks.append(remark)

    def fix(self, names: Iterable[str]) -> None:
        """Note that the value of a configuration decides what foreign code does."""
        codes = {
            part.code
            for name in names
            if isinstance(value := self.scope.configurations.get(name), Text)
            for part in value.parts
            if not isinstance(part, str)
        }
        for argument in self.result.arguments.values():
            # Expressions may hold several arguments.
            if any(
                re.search(rf'(?<![\w.]){re.escape(argument_code(argument.name))}(?!\w)', code)
                for code in codes
            ):
                argument.fixed = True

    def read(self, entities: Iterable[Any]) -> None:
        """Walk entities, one after the other."""
        for entity in entities:
            self._read_one(entity)

    def _read_one(self, entity: Any) -> None:
        before = self.origin
        self.origin = self.loader.origin_of(entity) or before
        try:
            condition = self._condition_of(entity)
            if condition is not None and not condition.code and not condition.holds:
                self.remark(f'{describe(entity)} is left out: its condition does not hold')
                return
            with self.scope.under(condition):
                self._dispatch(entity)
        except ComposerError:
            raise
        except Exception as error:
            message = f'{self.origin}: {type(error).__name__}: {error}'
            raise LaunchError(message) from error
        finally:
            self.origin = before

    def _dispatch(self, entity: Any) -> None:
        for name in class_names(entity):
            if name in _ACTIONS:
                getattr(self, _ACTIONS[name])(entity)
                return
        self._read_unknown(entity)

    def _condition_of(self, entity: Any) -> Condition | None:
        condition = getattr(entity, 'condition', None)
        return None if condition is None else self.read_condition(condition)

    def read_condition(self, condition: Any) -> Condition:
        """Return a condition of the launch file."""
        kinds = class_names(condition)
        if 'LaunchConfigurationEquals' in kinds:
            return self._compared(condition, is_equal='LaunchConfigurationNotEquals' not in kinds)
        predicate = private(condition, 'predicate_expression')
        if predicate is None:
            self.scope.fill(self.loader.context)
            self.remark('the condition was resolved')
            return Condition('', bool(condition.evaluate(self.loader.context)))
        value = self.resolver.text(predicate)
        holds = truth_of(value)
        is_unless = 'UnlessCondition' in kinds
        if value.is_constant:
            return Condition('', holds != is_unless)
        code = value.condition()
        return Condition(f'not ({code})' if is_unless else code, holds != is_unless)

    def _compared(self, condition: Any, *, is_equal: bool) -> Condition:
        name = private(condition, 'launch_configuration_name')
        expected = private(condition, 'expected_value')
        value = self.scope.configurations.get(name)
        if not isinstance(value, Text) or expected is None:
            return Condition('', ((value is None) == (expected is None)) == is_equal)
        other = self.resolver.text(expected)
        holds = (value.text == other.text) == is_equal
        if value.is_constant and other.is_constant:
            return Condition('', holds)
        return Condition(f'{value.code} {"==" if is_equal else "!="} {other.code}', holds)

    # What each kind of action does.

    def _description(self, entity: Any) -> None:
        self.read(entity.entities)

    def _argument(self, entity: Any) -> None:
        name = entity.name
        if isinstance(self.scope.configurations.get(name), Text):
            return
        written = private(entity, 'default_value')
        default = None if written is None else self.resolver.text(written)
        known = self.result.arguments.get(name)
        if known is not None and default is not None and known.default != default:
            # The first default is that of the argument; here it has another one.
            self.remark(
                f"the argument '{name}' has another default value here, {default.text!r}: it is "
                'used unless the import is given one'
            )
            if name not in self.given:
                self.scope.configurations[name] = default
                return
        choices = tuple(map(str, private(entity, 'choices') or ()))
        given = self.given.get(name)
        if given is None and default is None and known is None:
            given = choices[0] if choices else None
            if given is None:
                message = f"{self.origin}: the launch file requires the argument '{name}'"
                raise LaunchError(message, help=f'give it a value: {name}:=…')
        if known is None:
            description = private(entity, 'description') or ''
            if description in ('no description given', f'One of: {list(choices)}'):
                description = ''
            self.result.arguments[name] = Argument(name, default, description, choices, given)
        text = given if given is not None else (default.text if default else '')
        self.scope.configurations[name] = one(argument_code(name), text)

    def _set(self, entity: Any) -> None:
        self.scope.set(
            self.resolver.text(private(entity, 'name')).text,
            self.resolver.text(private(entity, 'value')),
        )

    def _unset(self, entity: Any) -> None:
        self.scope.configurations.pop(self.resolver.text(private(entity, 'name')).text, None)

    def _reset(self, entity: Any) -> None:
        kept = private(entity, 'launch_configurations') or {}
        values = {
            self.resolver.text(name).text: self.resolver.text(value)
            for name, value in kept.items()
        }
        self.scope.configurations.clear()
        self.scope.configurations.update(values)

    def _group(self, entity: Any) -> None:
        self.read(entity.get_sub_entities())

    def _include(self, entity: Any) -> None:
        if self._depth > _DEEPEST:
            message = f'{self.origin}: launch files include each other'
            raise LaunchError(message)
        source = entity.launch_description_source
        location = self.resolver.text(private(source, 'location'))
        arguments = [
            (self.resolver.text(name).text, value) for name, value in entity.launch_arguments
        ]
        values = [(name, self.resolver.text(value)) for name, value in arguments]
        description = self._description_of(source, location, values)
        if description is None:
            return
        for name, value in values:
            self.scope.set(name, value)
        before = self.scope.file
        self.scope.file = Path(location.text).absolute() if location.text else before
        if self.scope.file and self.scope.file not in self.result.files:
            self.result.files.append(self.scope.file)
        self._depth += 1
        try:
            self.read([description])
        finally:
            # `launch` does not set the file back: what follows sees that of the include.
            self._depth -= 1

    def _description_of(self, source: Any, location: Text, values: list[tuple[str, Text]]) -> Any:
        """Return the description of an included file; `None` if its package is not here."""
        path = Path(location.text)
        is_code = private(source, 'launch_description') is not None and not path.is_file()
        if path.is_file() or is_code or not location.text:
            if not location.is_constant and not _is_in_package(location):
                self.remark(f'which file is included depends on arguments; here {path.name}')
            self.scope.fill(self.loader.context)
            return self.loader.load(source, self.scope.file)
        self.remark(f"'{location.text}' is not here: ros2 launch will run it")
        written = location.written()
        share = package_path(location)
        data: dict[str, Any] = {'launch': share or written}
        if values:
            data['arguments'] = {name: value.written() for name, value in values}
        self.add('processes', path.name.partition('.')[0] or 'launch', data, None)
        return None

    def _function(self, entity: Any) -> None:
        self._opaque.run(entity)

    def _timer(self, entity: Any) -> None:
        period = self.resolver.text(private(entity, 'period'))
        if self.scope.delay is not None:
            period = one(
                f'{_number(self.scope.delay)} + {_number(period)}',
                str(float(self.scope.delay.text) + float(period.text)),
                'number',
            )
        with self.scope.after(None, period):
            self.read(private(entity, 'actions'))

    def _handler(self, entity: Any) -> None:
        handler = entity.event_handler
        kinds = class_names(handler)
        state = next((_STATES[kind] for kind in kinds if kind in _STATES), None)
        target = private(handler, 'action_matcher')
        actions = private(handler, 'actions_on_event')
        what = f'RegisterEventHandler({kinds[0]})'
        if 'OnStateTransition' in kinds:
            self._programs.read_transition(handler)
            return
        if state is None or not actions or not hasattr(target, 'execute'):
            self.remark(f'{what} cannot be kept: it runs code of its own')
            return
        if state == 'ended' and all(ends_system(each) for each in actions):
            self._programs.end_with(target)
            return
        with self.scope.after(Wait(target, state)):
            self.read(actions)

    def _variable(self, entity: Any) -> None:
        name = self.resolver.text(private(entity, 'name')).text
        self.scope.set_variable(name, self.resolver.text(private(entity, 'value')))

    def _append_variable(self, entity: Any) -> None:
        name = self.resolver.text(private(entity, 'name')).text
        value = self.resolver.text(private(entity, 'value'))
        separator = self.resolver.text(private(entity, 'separator')).text
        prepends = private(entity, 'prepend') is True
        before = self.scope.environment.get(name)
        old = before or one(f"env('{name}', '')", os.environ.get(name, ''))
        pair = (value, old) if prepends else (old, value)
        code = joined(pair, separator).code
        text = separator.join(each.text for each in pair) if old.text else value.text
        if before is None:
            code = f"({code} if env('{name}', '') else {value.code})"
        self.scope.set_variable(name, one(code, text))

    def _unset_variable(self, entity: Any) -> None:
        name = self.resolver.text(private(entity, 'name')).text
        if name in self.scope.environment:
            del self.scope.environment[name]
        self.remark(f'the environment variable {name} is unset: a process cannot unset one')

    def _push_configurations(self, _entity: Any) -> None:
        self.scope.push_configurations()

    def _pop_configurations(self, _entity: Any) -> None:
        self.scope.pop_configurations()

    def _push_environment(self, _entity: Any) -> None:
        self.scope.push_environment()

    def _pop_environment(self, _entity: Any) -> None:
        self.scope.pop_environment()

    def _reset_environment(self, _entity: Any) -> None:
        self.scope.environment = {}

    def _namespace(self, entity: Any) -> None:
        own = self.resolver.text(private(entity, 'namespace'))
        outer = self.scope.configurations.get('ros_namespace')
        full = join_namespaces(outer, own)
        if self.scope.when:
            before = outer or Text(())
            full = chosen(self.scope.when, full, before, is_true=self.scope.holds)
        self.scope.configurations['ros_namespace'] = full

    def _remap(self, entity: Any) -> None:
        rule = tuple(self.resolver.text(private(entity, each)) for each in ('src', 'dst'))
        self._common('ros_remaps').append((self.scope.when, *rule) if self.scope.when else rule)

    def _parameter(self, entity: Any) -> None:
        reader = ParameterReader(self.resolver, self.remark, self.loader.parse)
        values = reader.values(private(entity, 'param_dict'))
        if self.scope.when:
            self.remark(f'SetParameter has a condition, {self.scope.when}, which was resolved')
        if self.scope.holds:
            self._common('global_params').extend(values.items())

    def _parameter_file(self, entity: Any) -> None:
        path = self.resolver.text(private(entity, 'input_file') or private(entity, 'param_file'))
        self._common('global_params').append(path)

    def _common(self, name: str) -> list[Any]:
        # As in launch, a list that is there already is shared with the scopes around.
        found: list[Any] = self.scope.configurations.setdefault(name, [])
        return found

    def _sim_time(self, entity: Any) -> None:
        self.remark(f'{describe(entity)} is about the node of ros2 launch itself')

    def _log(self, entity: Any) -> None:
        self.remark(f'LogInfo: {self.resolver.text(private(entity, "msg")).text}')

    def _event(self, entity: Any) -> None:
        self._programs.read_event(entity)

    def _shutdown(self, _entity: Any) -> None:
        self.remark('Shutdown cannot be kept: on_exit of a process can stop the system')

    def _program(self, entity: Any) -> None:
        self._programs.read(entity)

    def _load_components(self, entity: Any) -> None:
        self._programs.read_components(entity)

    def _read_unknown(self, entity: Any) -> None:
        """Read an action of a class of its own: what it returns when it is run, if anything."""
        if not hasattr(entity, 'execute'):
            self.remark(f'{describe(entity)} cannot be kept')
            return
        self.scope.fill(self.loader.context)
        try:
            further = entity.execute(self.loader.context)
        except Exception as error:  # noqa: BLE001 - it is foreign code
            self.remark(f'{describe(entity)} cannot be kept: {error}')
            return
        self.remark(f'{describe(entity)} was resolved')
        self.read(further or ())

    def add(self, section: str, name: str, data: dict[str, Any], action: Any) -> Entry:
        """Add an entry to the system."""
        taken = {entry.name for entry in self.result.entries}
        plain = name or 'process'
        number = 2
        while name in taken or not name:
            name = f'{plain}_{number}'
            number += 1
        if self.scope.delay is not None:
            data['delay'] = _number_value(self.scope.delay)
        entry = Entry(
            section,
            name,
            data,
            action,
            self.origin,
            self.scope.when,
            self.scope.holds,
            list(self.scope.waits),
            dict(self.scope.environment),
        )
        self.result.entries.append(entry)
        return entry

    def forked(self) -> DescriptionReader:
        """Return a reader in the same place, whose results are its own."""
        other = DescriptionReader(self.loader, self.given)
        other.scope = Scope(
            {
                name: list(value) if isinstance(value, list) else value
                for name, value in self.scope.configurations.items()
            },
            dict(self.scope.environment),
            list(self.scope.conditions),
            list(self.scope.waits),
            self.scope.delay,
            self.scope.file,
        )
        other.result.arguments = {
            name: replace(each) for name, each in self.result.arguments.items()
        }
        other.result.entries = list(self.result.entries)
        other.result.files = list(self.result.files)
        other.origin = self.origin
        other.started = self.started
        other._depth = self._depth
        return other

    def adopt(self, other: DescriptionReader) -> None:
        """Go on as a reader that was forked."""
        self.scope.configurations = other.scope.configurations
        self.scope.environment = other.scope.environment
        self.result.arguments = other.result.arguments
        self.result.entries = other.result.entries
        self.result.files = other.result.files
        for remark in other.result.remarks:
            if remark not in self.result.remarks:
                self.result.remarks.append(remark)


def argument_code(name: str) -> str:
    """Return the expression for an argument."""
    return name if is_variable_name(name) else f"args['{name}']"


def describe(entity: Any) -> str:
    """Return the name of the class of an entity."""
    return type(entity).__name__


def ends_system(action: Any) -> bool:
    """Return whether an action stops all that was launched."""
    kinds = class_names(action)
    event = private(action, 'event')
    return 'Shutdown' in kinds or (event is not None and 'Shutdown' in class_names(event))


def join_namespaces(outer: Any, own: Text) -> Text:
    """Return a namespace in another one, as launch joins them."""
    if not isinstance(outer, Text) or not outer.parts:
        return own
    if own.is_constant:
        if own.text.startswith('/') or not own.text:
            return own if own.text else outer
        return joined((outer, own), '' if outer.text == '/' else '/')
    inside = joined((outer, own), '/')
    is_absolute = f"{own.code}.startswith('/')"
    relative = f'{inside.code} if {own.code} else {outer.code}'
    code = f'({own.code} if {is_absolute} else {relative})'
    text = own.text if own.text.startswith('/') else inside.text if own.text else outer.text
    return one(code, text)


def package_path(location: Text) -> str | None:
    """Return `package://name/path` for a constant path in the share folder of a package."""
    if not _is_in_package(location):
        return None
    first, *rest = location.parts
    package = '' if isinstance(first, str) else first.code[len("find('") : -len("')")]
    return f'{package}{Text(tuple(rest)).text}'


def _is_in_package(location: Text) -> bool:
    first = location.parts[0] if location.parts else ''
    if isinstance(first, str) or not first.code.startswith("find('"):
        return False
    return all(isinstance(part, str) for part in location.parts[1:])


def _number(value: Text) -> str:
    if value.is_constant:
        return value.text
    return value.code if value.kind == 'number' else f'({value.code} | float)'


def _number_value(value: Text) -> Any:
    number = float(value.text)
    return number if value.is_constant else Computed(f'{{{{ {_number(value)} }}}}', number)


_STATES = {
    'OnProcessExit': 'ended',
    'OnExecutionComplete': 'ended',
    'OnProcessStart': 'running',
}
# The method for each class of actions.
_ACTIONS = {
    'LaunchDescription': '_description',
    'DeclareLaunchArgument': '_argument',
    'SetLaunchConfiguration': '_set',
    'UnsetLaunchConfiguration': '_unset',
    'ResetLaunchConfigurations': '_reset',
    'PushLaunchConfigurations': '_push_configurations',
    'PopLaunchConfigurations': '_pop_configurations',
    'PushEnvironment': '_push_environment',
    'PopEnvironment': '_pop_environment',
    'ResetEnvironment': '_reset_environment',
    'GroupAction': '_group',
    'IncludeLaunchDescription': '_include',
    'OpaqueFunction': '_function',
    'TimerAction': '_timer',
    'RosTimer': '_timer',
    'RegisterEventHandler': '_handler',
    'SetEnvironmentVariable': '_variable',
    'AppendEnvironmentVariable': '_append_variable',
    'UnsetEnvironmentVariable': '_unset_variable',
    'PushROSNamespace': '_namespace',
    'PushRosNamespace': '_namespace',
    'SetRemap': '_remap',
    'SetParameter': '_parameter',
    'SetParametersFromFile': '_parameter_file',
    'SetUseSimTime': '_sim_time',
    'LogInfo': '_log',
    'Shutdown': '_shutdown',
    'EmitEvent': '_event',
    'LoadComposableNodes': '_load_components',
    'ExecuteLocal': '_program',
}
