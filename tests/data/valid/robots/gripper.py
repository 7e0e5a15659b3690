from dataclasses import dataclass

from sensor_msgs.msg import JointState


@dataclass(frozen=True)
class Limits:
    width: float
    force: float


def limits(node) -> Limits:
    return Limits(node.parameters.open_width, node.parameters.force)


def feel(node, message):
    is_holding = message.data >= limits(node).force * 0.5
    if is_holding != node.state.holding:
        node.state.holding = is_holding
        node.publish('holding', is_holding)


def open_up(node, request):
    node.state.target = limits(node).width
    return {'success': True}


def close(node, request):
    if node.state.holding:
        return {'success': False, 'message': 'something is held already'}
    node.state.target = 0.0
    return {'success': True, 'message': f'closing with {limits(node).force:.0f} N'}


def step(node):
    gap = node.state.target - node.state.width
    if abs(gap) > node.parameters.tolerance and not (node.state.holding and gap < 0):
        node.state.width += max(-0.005, min(0.005, gap))
    message = JointState(name=['left_finger', 'right_finger'])
    message.header.stamp = node.now().to_msg()
    message.position = [node.state.width / 2] * 2
    return message
