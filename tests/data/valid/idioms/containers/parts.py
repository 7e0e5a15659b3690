from itertools import groupby, zip_longest

from geometry_msgs.msg import Point, Pose, PoseArray
from sensor_msgs.msg import JointState


def make(node):
    messages = [JointState(name=['a_x', 'a_y', 'b_x']), None]
    message, _ = messages
    box = {'message': message}
    box['message'].position.extend((0.1, 0.2, 0.3))
    box['message'].velocity += type(message.position)('d', [1.0])
    holder = [box]
    holder[0]['message'].header.frame_id = 'box'
    return holder.pop().popitem()[1]


def unpack(node, message):
    groups = {k: [*v] for k, v in groupby(message.name, key=lambda n: n.split('_')[0])}
    joints = dict(zip_longest(message.name, message.velocity, fillvalue=0.0))
    node.state.groups, node.state.joints = groups, joints
    return ' '.join(f'{g}={len(n)}' for g, n in groups.items())


def best(node, message):
    (_, value), *_ = sorted(zip(message.name, message.position), key=lambda pair: -pair[1])
    joints = getattr(node.state, 'joints', {})
    return value + sum(v for k, v in joints.items() if k in message.name)


def poses(node):
    array = PoseArray()
    append = array.poses.append
    for i in range(3):
        append(Pose())
        array.poses[-1].position = Point(x=float(i))
    array.poses[0].position.y, array.poses[1].position.y = (p.position.x for p in array.poses[1:])
    array.poses = list(filter(lambda p: p.position.x < 2, reversed(array.poses)))
    array.poses.sort(key=lambda p: p.position.x)
    array.header = type(array.header)(frame_id='map')
    return array
