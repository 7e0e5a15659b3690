"""Whether all of a system runs that should, on the code that it should."""

from time import monotonic, sleep

from tests.running import DEADLINE_SEC
from tests.runtime.rewiring.descriptions import describe_bound, ros_of
from tests.runtime.rewiring.witness import WITNESS

# Timers with longer periods are not waited for.
_PROMPT_NS = 200_000_000
# What the behaviours know of types.
_TYPES = ('std_msgs/msg/String', 'std_srvs/srv/Trigger', 'test_msgs/action/Fibonacci')


def check_runs(system, observer, plan, told):
    """Wait until each behaviour has run that should; actions only if the plan names them."""
    touched = {each.target for each in plan.operations}
    pending = {}
    for full_name, node in system._nodes.items():
        for owner, view in node._views.items():
            section = f'{owner.kind}s'
            key = full_name, section, owner.name
            entity = node.entities[section].get(owner.name)
            if entity is None or (section == 'actions' and key not in touched):
                continue
            if full_name != WITNESS and _should_run(node, section, owner.name, entity):
                view.own_state.pop('ran', None)
                pending[key] = node, entity, view
    deadline = monotonic() + DEADLINE_SEC
    while pending:
        for key, (node, entity, view) in list(pending.items()):
            ran = view.own_state.get('ran')
            if ran is None:
                _ask(observer, node, key[1], getattr(node.spec, key[1])[key[2]])
            else:
                _check_ran(ran, describe_bound(entity), (told, key))
                del pending[key]
        assert monotonic() < deadline, f'{told}: does not run: {list(pending)}'
        sleep(0.002)


def _should_run(node, section, name, entity):
    spec = getattr(node.spec, section)[name]
    if spec.behaviour is None or not node.gate.is_open or node.gate.rests:
        return False
    if section != 'timers':
        return spec.type in _TYPES
    timer = ros_of(entity)
    is_simulated = node.ros.get_parameter('use_sim_time').value and spec.clock == 'ros'
    return timer.timer_period_ns < _PROMPT_NS and not is_simulated and not timer.is_canceled()


def _ask(observer, node, section, spec):
    """Let a behaviour have what it waits for."""
    if section == 'subscriptions':
        observer.publish(node.ros.resolve_topic_name(spec.topic), spec.type)
    elif section == 'services':
        observer.wait(observer.begin_call(node.ros.resolve_service_name(spec.service), spec.type))
    elif section == 'actions':
        name = node.ros.resolve_action_name(spec.action)
        observer.wait(observer.send_goal(name, spec.type, order=1))


def _check_ran(ran, bound, told):
    """Check that what a behaviour has noted is what it is bound to."""
    described = next(each for each in bound if 'TAG' in each['globals'])
    names = described['globals']
    tags = [names['TAG'], names['WORD'] if 'WORD' in names else names['helper'][1]['WORD']]
    if 'inner' in names:
        tags.append(names['inner'][1]['TAG'])
    assert [repr(each) for each in ran[1 : 1 + len(tags)]] == tags, (told, ran, tags)
    assert described['arguments'].items() <= ran[4].items(), (told, ran, described['arguments'])
