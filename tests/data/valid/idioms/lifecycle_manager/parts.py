from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState

NEXT = {
    (State.PRIMARY_STATE_UNCONFIGURED, Transition.TRANSITION_CONFIGURE): State.PRIMARY_STATE_INACTIVE,
    (State.PRIMARY_STATE_INACTIVE, Transition.TRANSITION_ACTIVATE): State.PRIMARY_STATE_ACTIVE,
}
LABELS = {getattr(State, f'PRIMARY_STATE_{label}'): label.lower() for label in ('UNCONFIGURED', 'INACTIVE', 'ACTIVE')}


def _current(node):
    return getattr(node.state, 'id', State.PRIMARY_STATE_UNCONFIGURED)


def change_state(node, request: ChangeState.Request) -> bool:
    try:
        node.state.id = NEXT[_current(node), request.transition.id]
    except KeyError:
        return False
    return True


def get_state(node, _request: GetState.Request) -> State:
    return State(id=(ident := _current(node)), label=LABELS[ident])


def startup(node):
    if not node.parameters.autostart:
        return
    for transition in ('CONFIGURE', 'ACTIVATE'):
        for name in node.parameters.node_names:
            ident = getattr(Transition, f'TRANSITION_{transition}')
            response = node.call(f'{name}/change_state', {'transition': {'id': ident, 'label': transition.lower()}})
            state = node.call('/'.join((name, 'get_state')), {}).current_state
            node.logger.info(f'{name}: {response.success} {state.label}')
            yield None
    yield True
