"""A launch description → the entries of a system.

The description is walked as `launch` would run it, with expressions in place of arguments. Its
objects are recognised by the names of their classes.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.launch_files.conditions import read_condition
from composer.launch_files.launched_programs import ProgramReader, ends_system
from composer.launch_files.parameters import ParameterReader
from composer.launch_files.place import join_namespaces, number_code
from composer.launch_files.results import Argument, LaunchError
from composer.launch_files.substitutions import Resolver, class_names, private, text_of
from composer.launch_files.surroundings import Setting, Wait
from composer.launch_files.texts import Text, joined, one

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.launch_files.place import Place
    from composer.launch_files.surroundings import Condition

# A launch file that includes itself would never end.
_DEEPEST = 40


class DescriptionReader:
    """Walks a launch description.

    Args:
        place: Where it is read, and where the results are.
    """

    def __init__(self, place: Place) -> None:
        self.place = place
        self._programs = ProgramReader(place, self.read)

    @property
    def _resolver(self) -> Resolver:
        return Resolver(self.place)

    def read(self, entities: Iterable[Any]) -> None:
        """Walk entities, one after the other."""
        for entity in entities:
            self._read_one(entity)

    def _read_one(self, entity: Any) -> None:
        before = self.place.origin
        self.place.origin = self.place.loader.origin_of(entity) or before
        try:
            condition = self._condition_of(entity)
            if condition is not None and not condition.code and not condition.holds:
                self.place.remark(f'{describe(entity)} is left out: its condition does not hold')
                return
            with self.place.scope.under(condition):
                self._dispatch(entity)
        except ComposerError:
            raise
        except Exception as error:
            message = f'{self.place.origin}: {type(error).__name__}: {error}'
            raise LaunchError(message) from error
        finally:
            self.place.origin = before

    def _dispatch(self, entity: Any) -> None:
        for name in class_names(entity):
            if name in _ACTIONS:
                getattr(self, _ACTIONS[name])(entity)
                return
        self._read_unknown(entity)

    def _condition_of(self, entity: Any) -> Condition | None:
        condition = getattr(entity, 'condition', None)
        return None if condition is None else read_condition(self.place, condition)

    # What each kind of action does.

    def _description(self, entity: Any) -> None:
        self.read(entity.entities)

    def _argument(self, entity: Any) -> None:
        name = entity.name
        if isinstance(self.place.scope.configurations.get(name), Text):
            return
        written = private(entity, 'default_value')
        default = None if written is None else self._resolver.text(written)
        known = self.place.result.arguments.get(name)
        if known is not None and default is not None and known.default != default:
            # The first default is that of the argument; here it has another one.
            self.place.remark(
                f"the argument '{name}' has another default value here, {default.text!r}: it is "
                'used unless the import is given one'
            )
            if name not in self.place.given:
                self.place.scope.configurations[name] = default
                return
        choices = tuple(map(str, private(entity, 'choices') or ()))
        description = private(entity, 'description') or ''
        if description in ('no description given', f'One of: {list(choices)}'):
            description = ''
        argument = known or Argument(name, default, description, choices)
        self.place.scope.configurations[name] = self.place.declare(argument)

    def _set(self, entity: Any) -> None:
        self.place.scope.set(
            self._resolver.text(private(entity, 'name')).text,
            self._resolver.text(private(entity, 'value')),
        )

    def _unset(self, entity: Any) -> None:
        self.place.result.freeze(self.place.scope.when)
        self.place.scope.configurations.pop(
            self._resolver.text(private(entity, 'name')).text, None
        )

    def _reset(self, entity: Any) -> None:
        kept = private(entity, 'launch_configurations') or {}
        values = {
            self._resolver.text(name).text: self._resolver.text(value)
            for name, value in kept.items()
        }
        self.place.result.freeze(self.place.scope.when)
        self.place.scope.configurations.clear()
        self.place.scope.configurations.update(values)

    def _group(self, entity: Any) -> None:
        self.read(entity.get_sub_entities())

    def _include(self, entity: Any) -> None:
        if self.place.depth > _DEEPEST:
            message = f'{self.place.origin}: launch files include each other'
            raise LaunchError(message)
        source = entity.launch_description_source
        location = self._resolver.text(private(source, 'location'))
        arguments = [
            (self._resolver.text(name).text, value) for name, value in entity.launch_arguments
        ]
        values = [(name, self._resolver.text(value)) for name, value in arguments]
        description = self._description_of(source, location, values)
        if description is None:
            return
        for name, value in values:
            self.place.scope.set(name, value)
        before = self.place.scope.file
        self.place.scope.file = Path(location.text).absolute() if location.text else before
        if self.place.scope.file and self.place.scope.file not in self.place.result.files:
            self.place.result.files.append(self.place.scope.file)
        self.place.depth += 1
        try:
            self.read([description])
        finally:
            # `launch` does not set the file back: what follows sees that of the include.
            self.place.depth -= 1

    def _description_of(self, source: Any, location: Text, values: list[tuple[str, Text]]) -> Any:
        """Return the description of an included file; `None` if its package is not here."""
        path = Path(location.text)
        is_code = private(source, 'launch_description') is not None and not os.path.isfile(path)
        if os.path.isfile(path) or is_code or not location.text:
            self.place.freeze(f'the include of {path.name}', location)
            self.place.scope.fill(self.place.loader.context, self.place.given)
            return self.place.loader.load(source, self.place.scope.file)
        self.place.remark(f"'{location.text}' is not here: ros2 launch will run it")
        written = location.written()
        share = package_path(location)
        data: dict[str, Any] = {'launch': share or written}
        if values:
            data['arguments'] = {name: value.written() for name, value in values}
        self.place.add('processes', path.name.partition('.')[0] or 'launch', data, None)
        return None

    def _function(self, entity: Any) -> None:
        scope, context = self.place.scope, self.place.loader.context
        function = private(entity, 'function')
        arguments, keywords = private(entity, 'args') or (), private(entity, 'kwargs') or {}
        entities = self.place.resolve(
            f'OpaqueFunction {function.__name__}',
            lambda: function(context, *arguments, **keywords),
        )
        for name, value in context.launch_configurations.items():
            before = scope.configurations.get(name)
            old = before.text if isinstance(before, Text) else self.place.given.get(name)
            if isinstance(value, str) and value != old:
                scope.set(name, text_of(value))
        self.read(entities or ())

    def _timer(self, entity: Any) -> None:
        period = self._resolver.text(private(entity, 'period'))
        if self.place.scope.delay is not None:
            period = one(
                f'{number_code(self.place.scope.delay)} + {number_code(period)}',
                str(float(self.place.scope.delay.text) + float(period.text)),
                'number',
            )
        with self.place.scope.after(None, period):
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
            self.place.remark(f'{what} cannot be kept: it runs code of its own')
            return
        if state == 'ended' and all(ends_system(each) for each in actions):
            self._programs.end_with(target)
            return
        with self.place.scope.after(Wait(target, state)):
            self.read(actions)

    def _variable(self, entity: Any) -> None:
        name = self._resolver.text(private(entity, 'name')).text
        self.place.scope.set_variable(name, self._resolver.text(private(entity, 'value')))

    def _append_variable(self, entity: Any) -> None:
        name = self._resolver.text(private(entity, 'name')).text
        value = self._resolver.text(private(entity, 'value'))
        separator = self._resolver.text(private(entity, 'separator')).text
        prepends = private(entity, 'prepend') is True
        before = self.place.scope.environment.get(name)
        old = before or one(f"env('{name}', '')", os.environ.get(name, ''))
        pair = (value, old) if prepends else (old, value)
        code = joined(pair, separator).code
        text = separator.join(each.text for each in pair) if old.text else value.text
        if before is None:
            code = f"({code} if env('{name}', '') else {value.code})"
        self.place.scope.set_variable(name, one(code, text))

    def _unset_variable(self, entity: Any) -> None:
        name = self._resolver.text(private(entity, 'name')).text
        self.place.result.freeze(self.place.scope.when)
        if name in self.place.scope.environment:
            del self.place.scope.environment[name]
        self.place.remark(f'the environment variable {name} is unset: a process cannot unset one')

    def _push_configurations(self, _entity: Any) -> None:
        self.place.scope.push_configurations()

    def _pop_configurations(self, _entity: Any) -> None:
        self.place.scope.pop_configurations()

    def _push_environment(self, _entity: Any) -> None:
        self.place.scope.push_environment()

    def _pop_environment(self, _entity: Any) -> None:
        self.place.scope.pop_environment()

    def _reset_environment(self, _entity: Any) -> None:
        self.place.scope.environment = {}

    def _namespace(self, entity: Any) -> None:
        own = self._resolver.text(private(entity, 'namespace'))
        outer = self.place.scope.configurations.get('ros_namespace')
        self.place.scope.configurations.setdefault('ros_namespace', Text(()))
        self.place.scope.set('ros_namespace', join_namespaces(outer, own))

    def _remap(self, entity: Any) -> None:
        rule = tuple(self._resolver.text(private(entity, each)) for each in ('src', 'dst'))
        self._set_for_all('ros_remaps', rule)

    def _parameter(self, entity: Any) -> None:
        values = ParameterReader(self.place).values(private(entity, 'param_dict'))
        for pair in values.items():
            self._set_for_all('global_params', pair)

    def _parameter_file(self, entity: Any) -> None:
        path = self._resolver.text(private(entity, 'input_file') or private(entity, 'param_file'))
        self._set_for_all('global_params', path)

    def _set_for_all(self, name: str, value: Any) -> None:
        # As in launch, a list that is there already is shared with the scopes around.
        scope = self.place.scope
        common = scope.configurations.setdefault(name, [])
        common.append(Setting(value, scope.codes, scope.holds))

    def _sim_time(self, entity: Any) -> None:
        self.place.remark(f'{describe(entity)} is about the node of ros2 launch itself')

    def _log(self, entity: Any) -> None:
        self.place.remark(f'LogInfo: {self._resolver.text(private(entity, "msg")).text}')

    def _event(self, entity: Any) -> None:
        self._programs.read_event(entity)

    def _shutdown(self, _entity: Any) -> None:
        self.place.remark('Shutdown cannot be kept: on_exit of a process can stop the system')

    def _program(self, entity: Any) -> None:
        self._programs.read(entity)

    def _load_components(self, entity: Any) -> None:
        self._programs.read_components(entity)

    def _read_unknown(self, entity: Any) -> None:
        """Read an action of a class of its own: what it returns when it is run, if anything."""
        if not hasattr(entity, 'execute'):
            self.place.remark(f'{describe(entity)} cannot be kept')
            return
        context = self.place.loader.context
        try:
            further = self.place.resolve(describe(entity), lambda: entity.execute(context))
        except LaunchError as error:
            self.place.remark(f'{describe(entity)} cannot be kept: {error}')
            return
        if not further:
            self.place.remark(f'{describe(entity)} was run by the import')
        self.read(further or ())


def describe(entity: Any) -> str:
    """Return the name of the class of an entity."""
    return type(entity).__name__


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
