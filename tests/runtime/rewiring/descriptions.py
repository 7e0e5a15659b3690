"""All that a running system is, as plain data: two systems of the same files are equal in it."""

import os
import sys
from functools import partial
from pathlib import Path
from types import CodeType, FunctionType, MethodType, ModuleType

from rclpy.logging import get_logger

from composer.entity_kinds import ENTITY_KINDS
from composer.runtime.nodes.behaviour_node import Node

# What a process need not know while it runs.
_NOT_OF_PROCESSES = ('path', 'wait_for', 'delay_sec', 'description')
_HOOKS = ('on_start', 'on_stop', 'on_configure', 'on_activate', 'on_deactivate', 'on_cleanup')
_HOOKS += ('on_error_state',)
# How rclpy describes it depends on whether it declares all overrides, which may be edited.
_SAID_BY_RCLPY = ('start_type_description_service',)


def describe(system):
    """Return all that a system is, as far as this process runs it."""
    spec, code = system._reading.spec, system._reading.snapshot.code
    return {
        'nodes': {name: describe_node(system, node) for name, node in system._nodes.items()},
        'processes': {
            name: describe_process(process)
            for name, process in sorted(system._processes.by_name.items())
        },
        'modules': sorted(name for name in code if name in sys.modules and code[name]),
        'threads': system._executor._spinner.scheduler._max_running,
        'timeouts': (system._handle.stop_timeout_sec, system._processes.timeout_sec),
        'environment': {name: os.environ.get(name) for name in spec.environment},
        'profiles': repr(system._handle.profiles),
        'closed': sorted(system._handle.without_parameter_services),
        'health': sorted(f'{node} {owner}' for node, owner in system._handle.health._entities),
        'diagnostics': system._control._period_sec,
        'pause_sec': system._hang_watcher._pause_sec,
        'is_alone': system._processes.is_alone,
    }


def merge(own, others):
    """Return what a system is of which several processes tell; its own process has no others."""
    every = [own, *others]
    return {
        **own,
        **{
            key: sorted({each for part in every for each in part[key]})
            for key in ('modules', 'closed', 'health')
        },
        'nodes': {name: node for part in every for name, node in part['nodes'].items()},
        'timeouts': sorted({part['timeouts'] for part in every}),
        'profiles': sorted({part['profiles'] for part in every}),
        'environment': [
            *{repr(part['environment']): part['environment'] for part in every}.values()
        ],
        'diagnostics': sorted({part['diagnostics'] for part in every}, key=str),
        'pause_sec': min(part['pause_sec'] for part in every),
    }


def expect_workers(spec, threads):
    """Return what the workers of a system should be.

    Args:
        threads: How many callbacks may run in the process of the system.
    """
    return {
        name: {
            'spec': repr(worker),
            'nodes': sorted(each.full_name for each in spec.nodes.values() if each.worker == name),
            'threads': worker.threads or threads,
            'cpus': {*worker.cpus} or os.sched_getaffinity(0),
            'nice': os.getpriority(os.PRIO_PROCESS, 0) + (worker.nice or 0),
            'environment': worker.environment.get('SIDE'),
            'restart': worker.restart,
        }
        for name, worker in spec.workers.items()
        if any(each.worker == name for each in spec.nodes.values())
    }


def describe_worker(worker, part):
    """Return what a worker is.

    Args:
        part: What its own process tells.
    """
    pid = worker.process.run.pid
    environment = Path(f'/proc/{pid}/environ').read_bytes().split(b'\0')
    sides = [each.decode()[5:] for each in environment if each.startswith(b'SIDE=')]
    return {
        'spec': repr(worker.spec),
        'nodes': sorted(part['nodes']),
        'threads': part['threads'],
        'cpus': os.sched_getaffinity(pid),
        'nice': os.getpriority(os.PRIO_PROCESS, pid),
        'environment': sides[0] if sides else None,
        'restart': worker.process.spec.restart,
    }


def describe_node(system, node):
    ros, spec = node.ros, node.spec
    if ros._late_events is not None:
        ros._late_events.create()  # It comes with the first event.
    parameters = {
        name: {
            'value': repr(parameter.value),
            'type': parameter.type_.name,
            'descriptor': None if name in _SAID_BY_RCLPY else str(ros.describe_parameter(name)),
        }
        for name, parameter in ros._parameters.items()
    }
    return {
        'entities': {
            kind.section: {
                name: describe_entity(node, kind.section, name, entity)
                for name, entity in sorted(node.entities[kind.section].items())
            }
            for kind in ENTITY_KINDS
            if node.entities.get(kind.section)
        },
        'counts': {
            section: len(list(getattr(ros, section)))
            for section in (
                *('publishers', 'subscriptions', 'services', 'clients', 'timers'),
                *('waitables', 'guards'),
            )
        },
        'parameters': parameters,
        'asking': describe_bound(node.parameters._asking),
        'callbacks': len(ros._on_set_parameters_callbacks),
        'level': get_logger(ros.get_logger().name).get_effective_level().name,
        'gate': (node.gate.is_open, node.gate.serves, node.gate.is_paused),
        'endpoints': len(node.endpoints),
        'suspended': len(node.suspended),
        'at_destruction': len(node.at_destruction),
        'limits': {
            str(owner): (limit.after_sec, limit._place())
            for owner, limit in node.limits.items()
            if owner.kind not in _HOOKS  # They count from the next call.
        },
        'state': sorted(vars(node.behaviour_node.state)),
        'hooks': [
            describe_function(node.functions[hook.name], hook.arguments)
            for hook in (spec.on_stop, spec.on_start)
            if hook is not None
        ],
        'has_begun': node.has_begun,
    }


def describe_entity(node, section, name, entity):
    if section == 'parameters':
        return None
    ros = ros_of(entity)
    described = {'place': node.place(getattr(node.spec, section)[name].path)}
    described['bound'] = describe_bound(entity)
    described['events'] = describe_bound(getattr(entity, 'events', None))
    group = getattr(ros, 'callback_group', None)
    described['group'] = (type(group).__name__, group_of(node, group))
    if section in ('publishers', 'subscriptions'):
        described['qos'] = describe_qos(ros.qos_profile)
        described['name'] = ros.topic_name
        described['type'] = f'{ros.msg_type.__module__} {ros.msg_type.__name__}'
    elif section in ('services', 'service_clients'):
        described['qos'] = describe_qos(ros.qos_profile)
        described['name'] = ros.service_name
        described['type'] = ros.srv_type.__name__
    elif section == 'timers':
        described['period'] = ros.timer_period_ns
        described['clock'] = ros.clock.clock_type.name
        described['constant'] = str(entity._ticker._spec.message)
        # One whose generator has ended is canceled sooner or later.
        ends = 'few_steps' in str(described['bound'])
        described['canceled'] = None if ends else ros.is_canceled()
    elif section == 'actions':
        described['name'] = ros._name if hasattr(ros, '_name') else None
        described['type'] = ros._action_type.__name__
        described['queue'] = (entity._queue.concurrency, entity._queue.is_closed)
    elif section == 'action_clients':
        described['name'] = ros._action_name if hasattr(ros, '_action_name') else None
        described['type'] = ros._action_type.__name__
    return described


def ros_of(entity):
    """Return the object of rclpy that an entity has."""
    for name in ('ros', '_ros', '_client'):
        if hasattr(entity, name):
            return getattr(entity, name)
    return entity


def group_of(node, group):
    """Return the name under which a node knows a callback group."""
    names = [name for name, each in node._groups.items() if each is group]
    known = {'serving': node.serving, 'background': node.background}
    return names or [name for name, each in known.items() if each is group]


def describe_process(process):
    spec = process.spec
    names = [each for each in spec.__dataclass_fields__ if each not in _NOT_OF_PROCESSES]
    return {**{name: repr(getattr(spec, name)) for name in names}, 'state': process.state}


def describe_qos(profile):
    return str(profile.get_c_qos_profile().to_dict())


def describe_bound(thing):
    """Return the behaviours that something of Composer's calls, with their arguments and code."""
    return sorted(
        (describe_function(each.func, each.keywords) for each in find_bound(thing)), key=str
    )


def find_bound(thing):
    """Return the behaviours with their nodes and arguments that something refers to."""
    found, seen, pending = [], set(), [thing]
    while pending:
        each = pending.pop()
        if id(each) in seen:
            continue
        seen.add(id(each))
        if isinstance(each, partial) and each.args and isinstance(each.args[0], Node):
            found.append(each)
        else:
            pending += _referred(each)
    return found


def _referred(each):
    if isinstance(each, partial):
        return [each.func, *each.args, *each.keywords.values()]
    if isinstance(each, MethodType):
        return [each.__self__, each.__func__]
    if isinstance(each, FunctionType):
        cells = [cell.cell_contents for cell in each.__closure__ or () if _is_filled(cell)]
        return [*cells, *(each.__defaults__ or ())]
    if isinstance(each, dict):
        return list(each.values())
    if type(each).__name__ in _HOLDERS:
        names = [*getattr(each, '__dict__', ()), *getattr(type(each), '__slots__', ())]
        return [getattr(each, name, None) for name in names if name not in _NOT_FOLLOWED]
    callback = getattr(each, 'callback', None)
    return [] if callback is None else [callback]


# Nodes; and goals in flight, which end on the code that they began with.
_NOT_FOLLOWED = ('_node', '_live_node', '_goal_handles', '_result_futures', '_queue', 'events')
_HOLDERS = {
    *('Publisher', 'Subscription', 'Timer', 'Service', 'ServiceClient', 'ActionServer'),
    *('ActionClient', '_Ticker', '_Execution', 'EventBehaviours', 'BehaviourCall'),
}


def _is_filled(cell):
    try:
        return cell.cell_contents is not cell
    except ValueError:
        return False


def describe_function(function, arguments):
    """Return a behaviour's name, arguments, code, and what its module's names mean."""
    function = getattr(function, '__func__', function)
    target = function if isinstance(function, FunctionType) else type(function).__call__
    names = target.__globals__
    return {
        'name': f'{target.__module__}:{target.__qualname__}',
        'arguments': dict(arguments),
        'code': _describe_code(target.__code__),
        'globals': {
            name: _describe_global(each)
            for name, each in sorted(names.items())
            if name[:2] != '__'
        },
    }


def _describe_global(value):
    if isinstance(value, ModuleType):
        if not str(getattr(value, '__file__', '')).startswith(str(Path.cwd())):
            return value.__name__
        inner = sorted(vars(value).items())
        return value.__name__, {
            name: _describe_global(each) for name, each in inner if name[:2] != '__'
        }
    return repr(value) if isinstance(value, int | str | float) else type(value).__name__


def _describe_code(code):
    constants = [
        _describe_code(each) if isinstance(each, CodeType) else repr(each)
        for each in code.co_consts
    ]
    return code.co_code, constants, code.co_names, code.co_firstlineno
