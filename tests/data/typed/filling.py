"""What messages are filled with, in mappings whose values have several types, and in lists."""

from dataclasses import dataclass
from enum import Enum

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Pose, PoseStamped, Twist
from nav_msgs.msg import Path
from std_srvs.srv import SetBool, Trigger


class Step(Enum):
    IDLE = 0
    MOVING = 1


@dataclass
class Leg:
    length: float
    done: bool = False

    def report(self):
        return f'{self.length} {self.dnoe and self.done}'  # error


def fill(node, odometry):
    pose = odometry.pose.pose
    names = [leg.length for leg in node.own_state.get('legs', [])]
    node.publish('plan', {'header': odometry.header, 'poses': [pose]})  # error
    node.publish('plan', {'header': pose.position, 'poses': [PoseStamped(pose=pose)]})  # error
    node.publish('plan', {'header': odometry.header, 'poses': [PoseStamped(pose=pose)]})
    node.publish('plan', Path(poses=[Pose()]))  # error
    path = Path()
    path.poses = [pose]  # error
    path.poses = [PoseStamped(pose=each) for each in (pose, Pose())]
    path.poses.append(pose)  # error
    odometry.pose.covariance = [pose.position.x, 0, 0.0] * 12
    odometry.twist.covariance = [0] * 36
    node.publish('joints', {'name': [Step.IDLE], 'position': [pose.position.x]})  # error
    node.publish('joints', {'name': Step.IDLE.name, 'position': [pose.position.x]})  # error
    node.publish('joints', {'name': ['a'], 'position': [pose.position.x, 1]})
    node.publish('joints', {'name': ['a'], 'position': {pose.position.x}})
    path.header.stamp = node.now() - node.now()  # error
    path.header = odometry.header.stamp  # error
    path.header.frame_id = path.header.stamp = odometry.header.stamp  # error
    node.publish('cmd', Twist)  # error
    node.publish('joints', {'name': [odometry.child_frame_id], 'position': names.copy})  # error


def ask(node, request):
    response = node.call(SetBool.Request(data=True))  # error
    node.call('light', SetBool.Requst())  # error
    node.call('light', Trigger)  # error
    level = DiagnosticStatus.OK if request.data else DiagnosticStatus.WARN
    if level != 0:  # error
        node.logger.info(', '.join(response.header))  # error
    leg = Leg(1.0)
    leg.clear()  # error
    leg.done = True
    legs = [Leg(1.0), Leg(2.0)]
    done = [each for each in legs if each.done]
    if request.data:
        return done  # error
    return {'success': done, 'message': f'{len(done)}'}  # error


def follow(node, path):
    node.logger.info(', '.join(path.header))  # error
    node.logger.info(path.header())  # error
    return True, 'followed'


class Walker:
    def __init__(self, node):
        super().__init__('walker')
        self.legs = [Leg(1.0)]
        self.first = None

    def step(self, node):
        from diagnostic_msgs.msg import DiagnosticStatus as Status

        self.first = Leg()  # error
        self.first = Leg(1.0, ended=True)  # error
        self.first.grow(2.0)  # error
        level = Status.OK if self.legs else Status.ERROR
        if node.name == Status.OK:  # error
            node.logger.info('ok')
        if level == 0:  # error
            steps = steps + 1  # noqa: F821  # error
            node.logger.info(f'{steps}')
        node.publish('cmd', self)  # error
        super().step(node)  # error
