"""A program of plain rclpy, as others write them: `foreign_nodes.py ROLE` runs until it is ended."""

import signal
import sys

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from sensor_msgs.msg import Image
from std_msgs.msg import String
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci

# What interrupts the imports ends the program, too.
signal.signal(signal.SIGINT, signal.SIG_DFL)
LATCHED = QoSProfile(
    depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE
)


def camera(namespace='/left'):
    node = rclpy.create_node('camera', namespace=namespace)
    limits = FloatingPointRange(from_value=1.0, to_value=60.0, step=0.5)
    described = ParameterDescriptor(description='Images a second.', floating_point_range=[limits])
    node.declare_parameter('rate', 30.0, described)
    node.declare_parameter('size', [640, 480])
    node.declare_parameter('frame', 'camera', ParameterDescriptor(read_only=True))
    node.declare_parameter('text', 'a: {{ b }}\n"c" # d')
    node.create_publisher(Image, '~/image', qos_profile_sensor_data)
    node.create_publisher(String, '/robot_description', LATCHED)
    node.create_publisher(DiagnosticArray, '/diagnostics', 10)
    node.create_service(SetBool, '~/enable', lambda _, response: response)
    node.action = ActionServer(node, Fibonacci, 'move', lambda goal: goal.succeed())
    return node


def viewer():
    node = rclpy.create_node('viewer', namespace='/left')
    node.create_subscription(Image, 'camera/image', print, qos_profile_sensor_data)
    node.create_subscription(String, '/robot_description', print, LATCHED)
    node.create_subscription(String, 'words', print, 10)
    node.create_client(SetBool, 'camera/enable')
    node.action = ActionClient(node, Fibonacci, 'move')
    return node


def silent():
    """Return a node without parameter services."""
    node = rclpy.create_node('silent', start_parameter_services=False)
    node.create_publisher(String, 'noise', 10)
    return node


def hung():
    """Return a node whose services never answer: nobody spins it."""
    node = rclpy.create_node('hung')
    node.declare_parameter('x', 1)
    return node


def right_camera():
    return camera('/right')


ROLES = {each.__name__: each for each in (camera, right_camera, viewer, silent, hung)}

if __name__ == '__main__':
    rclpy.init()
    nodes = [ROLES[role]() for role in sys.argv[1:]]
    executor = SingleThreadedExecutor()
    for each in nodes:
        if each.get_name() != 'hung':
            executor.add_node(each)
    sys.stdout.write('ready\n')
    sys.stdout.flush()
    executor.spin()
