from collections import defaultdict

from geometry_msgs.msg import Accel, Transform, TransformStamped, Twist, Vector3


def tree():
    return defaultdict(tree)


def nest(flat, separator='.'):
    root = tree()
    for path, value in flat.items():
        *parents, leaf = path.split(separator)
        branch = root
        for parent in parents:
            branch = branch[parent]
        branch[leaf] = value
    return root


def odom(node):
    header = {'header.stamp': node.now(), 'header.frame_id': 'odom'}
    return nest({**header, 'pose.pose.position.x': 1, 'pose.pose.orientation.w': 1.0, 'twist.twist.linear.x': 0.5, 'child_frame_id': 'base'})


def to_tf(node, msg):
    common = {'header': msg.header, 'child_frame_id': msg.child_frame_id}
    pose = msg.pose.pose
    move = Vector3(**{a: getattr(pose.position, a) for a in Vector3.get_fields_and_field_types()})
    return TransformStamped(**common, transform=Transform(translation=move, rotation=pose.orientation))


def accel(node):
    payload = tree()
    payload['accel']['linear'] = dict(zip('xyz', range(3)))
    payload['accel']['angular'] = Accel().angular
    payload['header']['frame_id'] = node.name
    return payload


def multi(node):
    point = {'transforms': [Transform()] * 2, 'velocities': [Twist(), {}], 'time_from_start': {'sec': 1}}
    return {'joint_names': ('virtual', 'world'), 'points': [point | {'time_from_start': {'sec': i}} for i in range(1, 3)]}
