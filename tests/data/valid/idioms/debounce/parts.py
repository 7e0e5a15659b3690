import random
from array import array

import numpy as np
from std_msgs.msg import Empty


def joy(node):
    return {'axes': np.random.uniform(-1, 1, 4).astype('f'), 'buttons': [random.randint(0, 1) for _ in range(4)]}


def edges(node, msg):
    previous = node.own_state.get('buttons') or array('i', [0] * len(msg.buttons))
    pressed = {name for name, now, before in zip(node.parameters.buttons, msg.buttons, previous) if now > before}
    node.own_state['buttons'] = msg.buttons
    if not getattr(node.state, 'muted', False):
        for button in pressed:
            last = node.own_state.get(('time', button))
            if last is None or (node.now() - last).nanoseconds > node.parameters.hold * 1e9:
                node.own_state['time', button] = node.now()
                node.publish(button, Empty())
    axes = np.array(msg.axes)
    axes[np.abs(axes) < node.parameters.deadzone] = 0
    if not axes.any():
        return None
    x, y, *_ = np.sign(axes) * axes ** 2
    return {'x': x, 'y': y}


def mode(node, request):
    changed = request.data is not vars(node.state).get('muted')
    node.state.muted = request.data
    return dict(success=changed, message=('loud', 'muted')[request.data])


def toggle(node):
    muted = node.state.muted = not getattr(node.state, 'muted', False)
    assert node.call('mode', {'data': muted}).message == ('muted' if muted else 'loud')
