"""Whether all of a process runs that should, on the code that it should."""

from tests.runtime.rewiring.base_system import WITNESSES
from tests.runtime.rewiring.descriptions import describe_bound, ros_of

# Timers with longer periods are not waited for.
_PROMPT_NS = 200_000_000
# What the behaviours know of types.
_TYPES = ('std_msgs/msg/String', 'std_srvs/srv/Trigger', 'test_msgs/action/Fibonacci')


class Runs:
    """The behaviours of this process that should run.

    Args:
        touched: The targets that an edit has named: of actions, only these are run.
    """

    def __init__(self, system, touched):
        self._pending = {}
        for full_name, node in system._nodes.items():
            for owner, view in node._views.items():
                section = f'{owner.kind}s'
                key = full_name, section, owner.name
                entity = node.entities[section].get(owner.name)
                if entity is None or (section == 'actions' and key not in touched):
                    continue
                if full_name not in WITNESSES and _should_run(node, section, owner.name, entity):
                    view.own_state.pop('ran', None)
                    self._pending[key] = node, entity, view

    def questions(self):
        """Return the section, the name and the type that others have each one run by."""
        return {
            key: _question(node, key[1], getattr(node.spec, key[1])[key[2]])
            for key, (node, _, _) in self._pending.items()
        }

    def take_ran(self, told):
        """Return the keys of those that have run, and see that it was what they are bound to."""
        ran = []
        for key, (_, entity, view) in list(self._pending.items()):
            if (noted := view.own_state.get('ran')) is not None:
                _check_ran(noted, describe_bound(entity), (told, key))
                ran.append(key)
                del self._pending[key]
        return ran


def _should_run(node, section, name, entity):
    spec = getattr(node.spec, section)[name]
    if spec.behaviour is None or not node.gate.is_open or node.gate.rests:
        return False
    if section != 'timers':
        return spec.type in _TYPES
    timer = ros_of(entity)
    is_simulated = node.ros.get_parameter('use_sim_time').value and spec.clock == 'ros'
    return timer.timer_period_ns < _PROMPT_NS and not is_simulated and not timer.is_canceled()


def _question(node, section, spec):
    resolve = {
        'subscriptions': lambda: node.ros.resolve_topic_name(spec.topic),
        'services': lambda: node.ros.resolve_service_name(spec.service),
        'actions': lambda: node.ros.resolve_action_name(spec.action),
    }.get(section, str)
    return section, resolve(), getattr(spec, 'type', None)


def _check_ran(ran, bound, told):
    """Check that what a behaviour has noted is what it is bound to."""
    described = next(each for each in bound if 'TAG' in each['globals'])
    names = described['globals']
    tags = [names['TAG'], names['WORD'] if 'WORD' in names else names['helper'][1]['WORD']]
    if 'inner' in names:
        tags.append(names['inner'][1]['TAG'])
    assert [repr(each) for each in ran[1 : 1 + len(tags)]] == tags, (told, ran, tags)
    assert described['arguments'].items() <= ran[4].items(), (told, ran, described['arguments'])
