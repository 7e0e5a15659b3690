from sensor_msgs.msg import *
from geometry_msgs.msg import *

from .kinematics import *
from . import kinematics


def prepare(node):
    missing = set(node.parameters.joints) - LINKS.keys()
    assert not missing, missing
    node.state.started = node.now()


def move(node):
    t = (node.now() - node.state.started).nanoseconds / 1e9
    names = node.parameters.joints
    msg = JointState(name=names)
    msg.header.stamp = node.now().to_msg()
    msg.position = [wave(t, i, node.parameters.amplitude) for i, _ in enumerate(names)]
    return msg


def on_joints(node, msg):
    x, y = kinematics.forward(dict(zip(msg.name, msg.position)))
    return Point(x=x, y=y, z=0.0)
