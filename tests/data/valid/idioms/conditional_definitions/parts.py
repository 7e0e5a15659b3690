import os
import sys
from typing import TYPE_CHECKING

try:
    import scipy.signal as signal
except ImportError:
    signal = None

try:
    from tf_transformations import euler_from_quaternion
except ModuleNotFoundError:
    def euler_from_quaternion(quaternion):
        return 0.0, 0.0, 2 * quaternion[2]

if TYPE_CHECKING:
    from composer import Node
else:
    Node = object

if sys.version_info >= (3, 8):
    def number(node: Node):
        return euler_from_quaternion((0, 0, 0.5, 1))[2] + 0.25
else:
    def number(node, message):
        return message

if os.name == 'posix':
    import posixpath as _path
else:
    import ntpath as _path


def rounded(node, value):
    raise NotImplementedError


def rounded(node, message):
    return round(message.data)


def text(node):
    if signal is not None:
        return str(signal.butter(1, 0.5))
    return _path.join('a', 'b')


try:
    wait
except NameError:
    def wait(node):
        node.state.waited = True
