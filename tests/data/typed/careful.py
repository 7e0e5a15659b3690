"""What looks wrong and is right: nothing here is an error."""

from geometry_msgs.msg import Pose, PoseStamped

LAST = {'pose': 0, 'text': 0}


class Careful:
    def __init__(self, node):
        self.place = False
        self.label = 0
        self.best = [0, None]

    def hear(self, node, odometry):
        self.place = odometry.pose.pose
        self.label = odometry.child_frame_id
        self.best[1] = odometry.pose.pose
        LAST['pose'], LAST['text'] = odometry.pose.pose, odometry.child_frame_id
        for index, value in enumerate(odometry.pose.covariance):
            if index > 0:
                node.logger.info(f'{value - before}')  # noqa: F821
            before = value  # noqa: F841
        parts = [odometry.pose.pose]
        parts.append(odometry.twist.twist)
        row = ['a', node.name]
        row.append(3)
        hits = [False] * 8
        hits[0] = 1.0
        node.logger.info(f'{parts} {row} {hits} {_x_of(odometry)}')

    def show(self, node):
        text = 0

        def choose():
            nonlocal text
            text = 'chosen'

        choose()
        node.publish('text', text)
        if self.place:
            node.publish('pose', {'pose': self.place})
            node.publish('text', self.label)
        if self.best[1]:
            node.publish('pose', {'pose': self.best[1]})
        if LAST['pose']:
            node.publish('pose', {'pose': LAST['pose']})
            node.publish('text', LAST['text'])
        rows = [1]
        rows.append('x')
        node.publish('text', rows[1])
        (node.publish('text', 'a'), node.publish('text', 'b'))
        node.logger.info(f'{_early(PoseStamped(), is_pose=False)}')


def _is_pose(message):
    return isinstance(message, Pose)


def _x_of(message):
    if _is_pose(message):
        return message.position.x
    return message.pose.pose.position.x


def _early(message, is_pose):
    if not is_pose:
        return message.pose.position
    return message.position
