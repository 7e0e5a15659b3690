from collections import ChainMap
from types import MappingProxyType

from visualization_msgs.msg import Marker

BASE = MappingProxyType({'ns': 'demo', 'type': Marker.SPHERE_LIST, 'action': Marker.ADD})
RED = dict(r=1.0, g=0.0, b=0.0, a=1.0)
UNIT = dict.fromkeys('xyz', 1.0)


def _header(node, **more):
    return {'header': {'stamp': node.now(), 'frame_id': node.parameters.frame} | more}


def marker(node):
    payload = {**BASE, 'color': RED, 'scale': UNIT | {'z': 0.1}} | _header(node)
    payload['id'] = node.own_state['id'] = (node.own_state.get('id', 0) + 1) % 5
    payload['points'] = [{axis: i * 0.1 for axis in 'xyz'} for i in range(payload['id'])]
    if payload['id'] > 2:
        payload['colors'] = [RED | {'g': i / 5} for i in range(payload['id'])]
    payload.setdefault('lifetime', {})['sec'] = 1
    return payload


def pose(node):
    position, orientation = dict(zip('xyz', (1, 2, 3))), {'w': 1.0}
    fields = {'pose': {'pose': {k: v for k, v in locals().items() if k in ('position', 'orientation')}}}
    if node.parameters.verbose:
        fields['pose'] |= {'covariance': [0.1 * (i % 7 == 0) for i in range(36)]}
    fields.update(_header(node, frame_id='odom'))
    return fields


def wrench(node):
    layers = ChainMap({'force': {'x': 1.0}}, {'force': {'y': 2.0}, 'torque': {'z': 3}})
    return _header(node) | {'wrench': dict(layers)}


def inspect(node, message):
    return len(message.points) if message.ns == BASE['ns'] else None
