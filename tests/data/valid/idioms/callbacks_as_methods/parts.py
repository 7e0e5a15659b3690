import math

from geometry_msgs.msg import Pose2D, Twist
from std_msgs.msg import ColorRGBA


class DrawSquare:
    instances = {}

    def __init__(self, node):
        self.node = node
        self.first_goal_set = False
        self.pose = None
        self.turtles = 1
        self.state = self.forward
        type(self).instances[node.name] = self

    def pose_callback(self, msg):
        self.pose = msg

    def timer_callback(self):
        if self.pose is None:
            return
        if not self.first_goal_set:
            self.first_goal_set = True
            self.goal = Pose2D(x=self.pose.x + 2 * math.cos(self.pose.theta), y=self.pose.y, theta=self.pose.theta)
        twist = Twist()
        self.state, twist.linear.x, twist.angular.z = self.state()
        return twist

    def forward(self):
        if abs(self.goal.x - self.pose.x) < 0.1:
            return self.turn, 0.0, 0.0
        return self.forward, 1.0, 0.0

    def turn(self):
        return self.forward, 0.0, 0.4

    def spawn_callback(self, request):
        self.turtles += 1
        self.node.publish('color', ColorRGBA(r=self.node.parameters.background_r / 255))
        return {'success': self.turtles <= self.node.parameters.max_steps, 'message': f'turtle{self.turtles}'}

    @classmethod
    def bind(cls, name):
        def callback(node, *args):
            return getattr(cls.instances[node.name], name)(*args)
        callback.__name__ = callback.__qualname__ = name
        return callback


pose_callback = DrawSquare.bind('pose_callback')
timer_callback = DrawSquare.bind('timer_callback')
spawn_callback = DrawSquare.bind('spawn_callback')


def simulate(node):
    pose = node.own_state.setdefault('pose', Pose2D())
    pose.x += 0.05
    return pose


def user(node):
    node.logger.info(node.call('spawn', {}).message)
