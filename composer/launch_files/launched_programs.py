"""Programs of a launch file: nodes, other processes, containers and their components."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.launch_files.conditions import read_condition
from composer.launch_files.parameters import ParameterReader
from composer.launch_files.place import join_namespaces
from composer.launch_files.substitutions import Resolver, class_names, private, truth_of
from composer.launch_files.surroundings import Wait
from composer.launch_files.texts import Computed, Text, chosen, code_of, joined, only_if

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from composer.launch_files.place import Place
    from composer.launch_files.results import Entry

_ROS_ARGS = '--ros-args'
_LOG_LEVELS = ('debug', 'info', 'warn', 'error', 'fatal')
_LOADER = 'component_container'
# A prefix that only lets the program start later.
SLEEP = re.compile(
    r"""\s*(?:\S*/)?(?:ba)?sh -c (["'])sleep ([\d.]+)s?\s*(?:;|&&)\s*"""
    r"""(?:exec\s+)?[^\w']*\$0[^\w']*\$@[^\w']*\1\s*"""
)
# What lifecycle transitions lead to, with `lifecycle:` of a process.
_TRANSITIONS = {1: 'inactive', 3: 'active'}


class ProgramReader:
    """Reads the programs of one launch description.

    Args:
        place: Where it is read.
        read: Reads actions.
    """

    def __init__(self, place: Place, read: Callable[[Iterable[Any]], None]) -> None:
        self._place = place
        self._read = read

    def read(self, action: Any) -> None:
        """Add a process."""
        kinds = class_names(action)
        if 'Node' in kinds:
            self._read_node(action, kinds)
        else:
            self._read_process(action)

    def end_with(self, target: Any) -> None:
        """Let the system end when a program ends."""
        entry = self._entry_of(target)
        if entry is None:
            self._place.remark('what ends the system is not among its processes')
        else:
            self._set_if_held(entry, 'on_exit', 'shutdown')

    def _set_if_held(self, entry: Entry, key: str, value: str) -> None:
        """Set a key of an entry to a value if the conditions hold here, and not only there."""
        scope = self._place.scope
        when = '' if scope.when == entry.when else scope.when
        entry.data[key] = only_if(when, value, entry.data.get(key), is_true=scope.holds)

    def read_event(self, entity: Any) -> None:
        """Read an event that is emitted at once: a transition of a lifecycle node."""
        event = private(entity, 'event')
        if 'ChangeState' not in class_names(event):
            self._place.remark(f'EmitEvent({type(event).__name__}) cannot be kept')
            return
        self._change_state(event)

    def read_transition(self, handler: Any) -> None:
        """Read a handler of a transition, which usually brings about the next one."""
        actions = private(handler, 'actions_on_event') or private(handler, 'entities') or ()
        actions = actions if isinstance(actions, list | tuple) else [actions]
        for action in actions:
            event = private(action, 'event')
            if event is not None and 'ChangeState' in class_names(event):
                self._change_state(event)
            elif 'LogInfo' not in class_names(action):
                self._place.remark('OnStateTransition cannot be kept')

    def _change_state(self, event: Any) -> None:
        state = _TRANSITIONS.get(getattr(event, 'transition_id', -1))
        lifecycle = [
            entry
            for entry in self._place.result.entries
            if entry.action is not None and 'LifecycleNode' in class_names(entry.action)
        ]
        matching = [entry for entry in lifecycle if _matches(event, entry.action)] or lifecycle
        if state is None or not matching:
            self._place.remark('ChangeState cannot be kept')
            return
        for entry in matching:
            if entry.data.get('lifecycle') != 'active':
                self._set_if_held(entry, 'lifecycle', state)

    def _entry_of(self, target: Any) -> Entry | None:
        entries = self._place.result.entries
        return next((entry for entry in entries if entry.action is target), None)

    def _read_node(self, action: Any, kinds: list[str]) -> None:
        resolver = Resolver(self._place)
        package, executable = private(action, 'package'), private(action, 'node_executable')
        program = resolver.text(executable)
        data: dict[str, Any] = {}
        own = [resolver.text(each) for each in private(action, 'arguments') or ()]
        if package is None:
            data['command'] = [program.written(), *(each.written() for each in own)]
        else:
            data['package'] = resolver.text(package).written()
            data['executable'] = program.written()
        ros_arguments = [resolver.text(each) for each in private(action, 'ros_arguments') or ()]
        level = _take_log_level(ros_arguments)
        words = [each.written() for each in own]
        if ros_arguments:
            words += [_ROS_ARGS, *(each.written() for each in ros_arguments)]
        name = private(action, 'node_name')
        name_text = resolver.text(name)
        if name is not None:
            data['name'] = name_text.written()
        self._add_namespace(data, private(action, 'node_namespace'))
        if words and package is not None:
            data['arguments'] = words
        elif ros_arguments:
            data['command'] += words[len(own) :]
        self._add_parameters(data, private(action, 'parameters') or (), is_dumped=True)
        self._add_remaps(data, private(action, 'remappings') or ())
        if level is not None:
            data['log_level'] = level
        self._add_keys(data, action)
        is_container = private(action, 'composable_node_descriptions') is not None
        label = name_text.text or program.text.rpartition('/')[2]
        entry = self._add('processes', label, data, action)
        if is_container or _LOADER in program.text:
            entry.section = 'containers'
            data['components'] = {}
            for component in private(action, 'composable_node_descriptions') or ():
                self._add_component(entry, component)
        if 'LifecycleNode' in kinds and (written := private(action, 'autostart')):
            self._start_lifecycle(data, resolver.is_true(written))

    @staticmethod
    def _start_lifecycle(data: dict[str, Any], autostart: Text) -> None:
        holds = truth_of(autostart)
        if not autostart.is_constant:
            code = f'({autostart.condition()})'
            data['lifecycle'] = only_if(code, 'active', None, is_true=holds)
        elif holds:
            data['lifecycle'] = 'active'

    def read_components(self, action: Any) -> None:
        """Add components to a container: one of the system, or one that runs already."""
        target = private(action, 'target_container')
        entry = self._entry_of(target) if hasattr(target, 'execute') else self._named(target)
        for component in private(action, 'composable_node_descriptions') or ():
            self._add_component(entry, component)

    def _named(self, target: Any) -> Entry:
        """Return the container of a name; one that runs already if the system has none."""
        resolver = Resolver(self._place)
        name = resolver.text(target)
        for entry in self._place.result.entries:
            own, namespace = entry.data.get('name'), entry.data.get('namespace', '')
            values = [
                each.value if isinstance(each, Computed) else each for each in (own, namespace)
            ]
            full = f'/{values[1] or ""}/{values[0]}'.replace('//', '/').replace('//', '/')
            if entry.section == 'containers' and name.text in (values[0], full, full.lstrip('/')):
                is_same = name.written() in (own, f'/{own}', full, full.lstrip('/'))
                self._place.result.freeze(
                    *() if is_same else (name, _text_of(own), _text_of(namespace))
                )
                return entry
        key = f'/{name.text.lstrip("/")}'
        if not name.is_constant:
            key = Computed(f"{{{{ '/' ~ {name.code}.lstrip('/') }}}}", key)
        for entry in self._place.result.entries:
            if entry.action is None and entry.name == key:
                return entry
        entry = self._add('containers', key, {'components': {}}, None)
        # Others may load components into it under other conditions.
        entry.when = ''
        return entry

    def _add_component(self, entry: Entry | None, component: Any) -> None:
        place, resolver = self._place, Resolver(self._place)
        condition = component.condition() if callable(component.condition) else None
        held = read_condition(place, condition) if condition is not None else None
        if entry is None or (held is not None and not held.code and not held.holds):
            return
        name = resolver.text(private(component, 'node_name'))
        plugin = resolver.text(private(component, 'node_plugin'))
        data: dict[str, Any] = {
            'package': resolver.text(private(component, 'package')).written(),
            'plugin': plugin.written(),
        }
        self._add_namespace(data, private(component, 'node_namespace'))
        self._add_parameters(data, private(component, 'parameters') or ())
        # A generator of launch_ros: it gives the rules once, and several actions may load it.
        rules = list(private(component, 'remappings') or ())
        self._add_remaps(data, vars(component).setdefault('_composer_remappings', rules))
        extra: dict[str, Any] = {}
        for each in private(component, 'extra_arguments') or ():
            extra |= ParameterReader(place).values(each)
        if 'use_intra_process_comms' in extra:
            data['intra_process'] = extra.pop('use_intra_process_comms')
        if extra:
            data['extra_arguments'] = extra
        with place.scope.under(held):
            when = place.scope.when
        if when and when != entry.when:
            data['when'] = Computed(f'{{{{ {when} }}}}', True)
        label: str = name.written()
        if not label:
            label, data['name'] = plugin.text.rpartition(':')[2], None
        components: dict[str, Any] = entry.data['components']
        if label in components and components[label].get('namespace') != data.get('namespace'):
            label = _full_name(data.pop('namespace', ''), label)
        if label in components and not when:
            place.remark(f"a second component '{label}' of one container is left out")
            return
        while label in components:
            # Another expression for the same name: only one of them is there at a time.
            code = label[len('{{ ') : -len(' }}')] if isinstance(label, Computed) else repr(label)
            label = Computed(f'{{{{ ({code}) }}}}', label)
        components[label] = data

    def _read_process(self, action: Any) -> None:
        resolver = Resolver(self._place)
        words = [resolver.text(each) for each in private(action, 'cmd') or action.cmd]
        program = words[0] if words else Text(())
        data: dict[str, Any]
        if private(action, 'shell') is True:
            data = {'command': ['/bin/sh', '-c', joined(words, ' ').written()]}
        else:
            data = {'command': [each.written() for each in words]}
        self._add_keys(data, action)
        name = resolver.text(private(private(action, 'process_description'), 'name'))
        first = Path((name.text or program.text).split(' ')[0]).name
        self._add('processes', first or 'process', data, action)

    def _add(self, section: str, name: str, data: dict[str, Any], action: Any) -> Entry:
        place = self._place
        entry = place.add(section, name, data, action)
        on_exit = private(action, 'on_exit') if action is not None else None
        if on_exit is not None:
            self._read_on_exit(entry, on_exit)
        return entry

    def _read_on_exit(self, entry: Entry, on_exit: Any) -> None:

        place = self._place
        actions = on_exit if isinstance(on_exit, list | tuple) else [on_exit]
        if any(not hasattr(each, 'execute') for each in actions):
            place.remark('on_exit runs code of its own, which cannot be kept')
            return
        if any(map(ends_system, actions)):
            entry.data['on_exit'] = 'shutdown'
        with place.scope.after(Wait(entry.action, 'ended')):
            self._read([each for each in actions if not ends_system(each)])

    def _add_namespace(self, data: dict[str, Any], written: Any) -> None:

        outer = self._place.scope.configurations.get('ros_namespace')
        if written is None and not isinstance(outer, Text):
            return
        own = Resolver(self._place).text(written)
        full = join_namespaces(outer, own)
        if full.parts and not (full.is_constant and full.text == ''):
            data['namespace'] = full.written()
        elif written is not None:
            data['namespace'] = '/'

    def _add_parameters(
        self, data: dict[str, Any], written: Any, *, is_dumped: bool = False
    ) -> None:
        place = self._place
        parameters = ParameterReader(place, is_dumped=is_dumped)
        common = place.scope.configurations.get('global_params', ())
        read = parameters.read(written, common)
        if read.values:
            data['parameters'] = read.values
        if read.files:
            data['parameter_files'] = read.files

    def _add_remaps(self, data: dict[str, Any], written: Any) -> None:
        resolver = Resolver(self._place)
        rules: dict[str, Text] = {}
        own = [(*map(resolver.text, pair), '') for pair in written]
        common = self._place.scope.configurations.get('ros_remaps', ())
        every = [(*each.value, self._place.scope.besides(each), each.holds) for each in common]
        # The first rule for a name that holds; without one, the name itself.
        for source, target, when, *holds in reversed([*every, *own]):
            key = source.written()
            before = rules.get(key, source)
            rules[key] = chosen(when, target, before, is_true=all(holds)) if when else target
        if rules:
            data['remap'] = {key: rules[key].written() for key in reversed(rules)}

    def _add_keys(self, data: dict[str, Any], action: Any) -> None:
        """Add what all processes have."""
        place, resolver = self._place, Resolver(self._place)
        description = private(action, 'process_description')
        env = {
            resolver.text(key).text: resolver.text(value).written()
            for key, value in private(description, 'additional_env') or ()
        }
        if private(description, 'env') is not None:
            place.remark('env: the process also has the environment of the system')
            env |= {
                resolver.text(key).text: resolver.text(value).written()
                for key, value in private(description, 'env')
            }
        if env:
            data['env'] = env
        if private(description, 'cwd') is not None:
            cwd = resolver.text(private(description, 'cwd'))
            data['cwd'] = cwd.written() if cwd.text.startswith('/') else _beside(cwd)
        prefix = resolver.text(private(description, 'prefix'))
        if (sleep := SLEEP.fullmatch(prefix.text)) and prefix.is_constant:
            data['delay'] = float(sleep[2])
        elif prefix.parts:
            place.result.freeze(prefix)
        if prefix.text.strip() and 'delay' not in data:
            place.remark(f"the prefix '{prefix.text}' cannot be kept")
        self._add_restart(data, action)
        timeouts = [
            resolver.text(private(action, f'{each}_timeout')) for each in ('sigterm', 'sigkill')
        ]
        if any(not each.is_constant or each.text not in ('5', '5.0') for each in timeouts):
            self._add_timeout(data, timeouts)

    def _add_restart(self, data: dict[str, Any], action: Any) -> None:
        resolver = Resolver(self._place)
        respawn = resolver.is_true(private(action, 'respawn'))
        if respawn.is_constant and not (respawn.text and truth_of(respawn)):
            return
        when: Any = 'always'
        if not respawn.is_constant:
            code = f"{{{{ 'always' if ({respawn.condition()}) else 'never' }}}}"
            when = Computed(code, 'always' if truth_of(respawn) else 'never')
        delay = private(action, 'respawn_delay')
        data['restart'] = {'when': when, 'delay': _seconds(resolver.text(delay))}
        most = private(action, 'respawn_max_retries')
        if isinstance(most, int) and most >= 0:
            data['restart']['max'] = most

    def _add_timeout(self, data: dict[str, Any], timeouts: list[Text]) -> None:
        if all(each.is_constant for each in timeouts):
            data['stop'] = {'timeout': sum(map(float, (each.text for each in timeouts)))}
        else:
            terms = (
                each.text if each.is_constant else f'({each.code} | float)' for each in timeouts
            )
            total = sum(float(each.text or 5) for each in timeouts)
            data['stop'] = {'timeout': Computed(f'{{{{ {" + ".join(terms)} }}}}', total)}


def _full_name(namespace: str, name: str) -> str:
    """Return the name with the namespace, from the root, as the key of a component."""
    values = [each.value if isinstance(each, Computed) else each for each in (namespace, name)]
    text = re.sub('/+', '/', '/'.join(('', *values)))
    if not isinstance(namespace, Computed) and not isinstance(name, Computed):
        return text
    code = f"('/' ~ {code_of(namespace)} ~ '/' ~ {code_of(name)})"
    return Computed(f"{{{{ {code} | replace('//', '/') | replace('//', '/') }}}}", text)


def _text_of(value: Any) -> str:
    return str(value) if isinstance(value, Computed) else ''


def _seconds(text: Text) -> Any:
    if text.is_constant:
        return float(text.text or 0)
    return Computed(f'{{{{ {text.code} | float }}}}', float(text.text))


def _take_log_level(words: list[Text]) -> str | None:
    """Take the one log level out of arguments for ROS."""
    places = [i for i, each in enumerate(words[:-1]) if each.text == '--log-level']
    if len(places) != 1 or words[places[0] + 1].text.lower() not in _LOG_LEVELS:
        return None
    level = words[places[0] + 1]
    del words[places[0] : places[0] + 2]
    return level.written() if not level.is_constant else level.text.lower()


def _beside(path: Text) -> str:
    return joined((Text((f'{os.getcwd()}/',)), path)).written()  # noqa: PTH109 - as a text


def _matches(event: Any, action: Any) -> bool:
    matcher = private(event, 'lifecycle_node_matcher')
    try:
        return bool(matcher(action))
    except Exception:  # noqa: BLE001 - a function of the launch file
        return False


def ends_system(action: Any) -> bool:
    """Return whether an action stops all that was launched."""
    kinds = class_names(action)
    event = private(action, 'event')
    return 'Shutdown' in kinds or (event is not None and 'Shutdown' in class_names(event))
