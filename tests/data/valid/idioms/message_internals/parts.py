import copy

from sensor_msgs.msg import Imu


def make(node):
    imu = Imu()
    imu.__init__(orientation_covariance=[0.5] * 9)
    object.__setattr__(imu, '_angular_velocity', imu.linear_acceleration.__class__(x=1.0))
    imu.header.stamp = node.now().to_msg()
    return imu


def describe(node, message):
    names = [slot[1:] for slot in message.__slots__ if not slot.startswith('_check')]
    types = dict(zip(names, message.SLOT_TYPES))
    kinds = message.get_fields_and_field_types()
    assert kinds.keys() == types.keys() and message.__class__ is Imu
    return f'{message.__class__.__module__.split(".")[0]}: {len(str(message))} {kinds["header"]} {message._header is message.header}'


def rebuild(node, message):
    fields = {name: getattr(message, name) for name in message.get_fields_and_field_types()}
    other = Imu(**fields)
    assert other == message and not other != message and repr(other) == repr(message)
    clone = copy.copy(other)
    clone.header = copy.deepcopy(other.header)
    clone.header.frame_id += 'clone'
    assert other.header.frame_id == message.header.frame_id
    getattr(clone, 'orientation').w = 1.0
    clone.angular_velocity.x, clone.angular_velocity.y = clone.angular_velocity.y, clone.angular_velocity.x
    return clone
