import colorsys
import itertools
from functools import partial

from std_msgs.msg import ColorRGBA

DARK = ColorRGBA()


def plain(node):
    red, green, blue = (each / 255 for each in node.parameters.color)
    return ColorRGBA(r=red, g=green, b=blue, a=1.0)


def blink(node, every=2):
    return plain(node) if node.state.tick % every == 0 else DARK


def rainbow(node):
    hue = (node.state.tick % 36) / 36
    red, green, blue = colorsys.hsv_to_rgb(hue, 1.0, 1.0)
    return ColorRGBA(r=red, g=green, b=blue, a=1.0)


MODES = {'on': plain, 'blink': blink, 'slow': partial(blink, every=4), 'rainbow': rainbow}


def choose(node, message):
    if message.data not in MODES:
        known = ', '.join(itertools.chain(MODES, ['off']))
        node.logger.warning(f'there is no mode {message.data!r}: {known}')
    node.own_state['mode'] = message.data
    node.state.mode = message.data


def show(node):
    node.state.tick = getattr(node.state, 'tick', 0) + 1
    mode = MODES.get(getattr(node.state, 'mode', 'on'))
    return mode(node) if mode else DARK
