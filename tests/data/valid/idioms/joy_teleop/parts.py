import array
import itertools
from collections import defaultdict

from geometry_msgs.msg import Twist

FIELD = {'x': 'x', 'y': 'y', 'z': 'z', 'yaw': 'z', 'pitch': 'y', 'roll': 'x'}


def read_pad(node):
    phase = node.own_state.setdefault('phase', itertools.cycle(range(3)))
    buttons = [0] * 12
    step = next(phase)
    if step:
        buttons[3 + step] = 1
    return {
        'header': {'stamp': node.now(), 'frame_id': 'joy'},
        'axes': array.array('f', (0.1, 0.9, 0, -0.5)),
        'buttons': array.array('i', buttons),
    }


def load_mapping(node):
    mapping = defaultdict(dict)
    for name, value in node.parameters.items():
        group, _, axis = name.partition('.')
        if axis:
            mapping[group][axis] = value
    node.state.mapping = dict(mapping)


def _fill(twist, joy, mapping, suffix=''):
    for kind in ('linear', 'angular'):
        vector = getattr(twist, kind)
        scales = mapping[f'scale_{kind}{suffix}']
        for axis, index in mapping[f'axis_{kind}'].items():
            setattr(vector, FIELD[axis], joy.axes[index] * scales[axis])
    return twist


def on_joy(node, joy):
    mapping = node.state.mapping
    pressed = lambda name: len(joy.buttons) > (i := node.parameters[name]) >= 0 and joy.buttons[i]
    if pressed('enable_turbo_button'):
        node.publish('cmd_vel', _fill(Twist(), joy, mapping, '_turbo'))
    elif pressed('enable_button'):
        node.publish('cmd_vel', _fill(Twist(), joy, mapping))
    elif vars(node.state).get('moving'):
        node.publish('cmd_vel', Twist())
    node.state.moving = any(map(pressed, ('enable_turbo_button', 'enable_button')))
