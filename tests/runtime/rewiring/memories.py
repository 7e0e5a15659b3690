"""What must stay of a running system while others of its parts are edited."""

import weakref
from time import monotonic_ns

from composer.entity_kinds import ENTITY_KINDS
from composer.planning.plan import Action
from tests.runtime.rewiring.descriptions import find_bound, ros_of

_GONE = (Action.REMOVE, Action.RECREATE)
# What behaviours change all the time.
_MOVING = ('count', 'heard', 'heard_afar', 'held')
# How exactly the time of a tick can be told: the clocks are read one after the other.
_SOON_NS = 200_000
_PHASE_NS = 2_000_000


class Same:
    """One object, which it does not keep."""

    def __init__(self, thing):
        try:
            self._find = weakref.ref(thing)
        except TypeError:
            number = id(thing)
            self._find = lambda: number
        self._text = repr(thing)

    def __eq__(self, other):
        if not isinstance(other, Same):
            return False
        return self._find() is not None and self._find() == other._find()

    def __hash__(self):
        return 0

    def __repr__(self):
        return self._text


def remember(system):
    """Return what must stay of each part, by its target in plans."""
    found = {}
    for full_name, node in system._nodes.items():
        found[full_name, 'nodes', ''] = {
            'ros': Same(node.ros),
            'state': Same(node.behaviour_node.state),
            'gate': Same(node.gate),
            'values': {
                key: repr(each)
                for key, each in vars(node.behaviour_node.state).items()
                if key not in _MOVING
            },
        }
        for kind in ENTITY_KINDS:
            for name in getattr(node.spec, kind.section):
                target = full_name, kind.section, name
                if kind.section == 'parameters':
                    found[target] = _remember_parameter(node.ros, name)
                else:
                    found[target] = _remember_entity(system, node, kind, name)
    for name, process in system._processes.by_name.items():
        found['', 'processes', name] = {'run': process.run and process.run.number}
    return found


def _remember_parameter(ros, name):
    return {
        'value': repr(ros._parameters[name].value),
        'descriptor': str(ros._descriptors[name]),
    }


def _remember_entity(system, node, kind, name):
    entity = node.entities[kind.section][name]
    ros = ros_of(entity)
    own = {
        f'own_state {owner}': Same(view)
        for owner, view in node._views.items()
        if (owner.kind, owner.name) == (kind.noun, name)
    }
    health = {
        f'health {owner}': Same(each)
        for (full_name, owner), each in getattr(system._handle.health, '_entities', {}).items()
        if full_name == node.full_name and (owner.kind, owner.name) == (kind.noun, name)
    }
    kept = {'entity': Same(entity), 'ros': Same(ros), **own, **health}
    if kind.is_timed:
        kept['phase'] = read_phase(ros)
    return {**kept, 'bound': [Same(each.func) for each in find_bound(entity)]}


def read_phase(timer):
    """Return when a timer ticks next; `None` if simulated time tells."""
    if getattr(timer.clock, 'ros_time_is_active', False):
        return None
    while not timer.is_canceled():
        begun_ns = monotonic_ns()
        left_ns = timer.time_until_next_call()
        if left_ns is None:
            break
        if monotonic_ns() - begun_ns < _SOON_NS:
            return Phase(begun_ns + left_ns, timer.timer_period_ns)
    return Phase(0, 0)


class Phase:
    """When a timer ticks: two are equal if they are whole periods apart."""

    def __init__(self, next_ns, period_ns):
        self.next_ns, self.period_ns = next_ns, period_ns

    def __eq__(self, other):
        if self.period_ns != other.period_ns or not self.period_ns:
            return self.period_ns == other.period_ns
        rest = (other.next_ns - self.next_ns) % self.period_ns
        is_whole = min(rest, self.period_ns - rest) < _PHASE_NS
        return is_whole and other.next_ns > self.next_ns - _PHASE_NS

    def __hash__(self):
        return 0

    def __repr__(self):
        return f'{self.next_ns} + n * {self.period_ns}'


def find_lost(before, after, operations):
    """Return what a plan has not named, and is not as it was: its target, key, and values."""
    named = {each.target: each for each in operations}
    lost = []
    for target, kept in before.items():
        node = named.get((target[0], 'nodes', ''))
        own = named.get(target)
        if node is not None and node.action in _GONE:
            continue
        if own is not None and own.action is Action.REMOVE:
            continue
        now = after.get(target, {})
        lost += [
            (target, key, kept[key], now.get(key))
            for key in kept
            if _stays(key, own) and not _is_same(kept[key], now.get(key))
        ]
    return lost


def _is_same(old, new):
    if isinstance(old, dict):
        # State that was not there before is new.
        return all(new[key] == value for key, value in old.items() if key in new)
    if isinstance(old, Phase) and new is None:
        return True
    return old is None or old == new


def _stays(key, operation):
    """Return whether an operation on something leaves this of it as it was."""
    if operation is None:
        return True
    changed = {each.top_key for each in operation.changes}
    if key.startswith('health') and key.endswith(')'):
        # As of `action 'count' (accept)`: the edit may remove just that.
        return key.rpartition('(')[2][:-1] not in changed
    if operation.action is Action.RECREATE:
        return key.startswith(('own_state', 'health'))
    if key == 'phase':
        return not {'period', 'rate'} & changed
    return key not in ('bound', 'value', 'descriptor')
