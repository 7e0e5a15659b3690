"""Entities made in code are as known as those that are declared."""

from sensor_msgs import msg as sensors


def begin(node):
    node.create_publisher('std_msgs/msg/String', node.parameters.source, name='echo')
    node.create_client('std_srvs/srv/SetBool', '/light', name='light')


def tick(node):
    node.publish('echo', 'x')
    node.publish('echo', {'dat': 'x'})  # error
    node.publish('ehco', 'x')  # error
    node.call('light', True).message.upper()
    node.call('light', True).messge.upper()  # error
    node.publish('status', 'x')


def begin_several(node):
    for source in node.parameters.sources:
        node.create_publisher('std_msgs/msg/String', source)


def wander(node):
    node.publish('/chat', 'x')
    node.publish('status', 'x')
    node.call('light', True)  # error


SENSORS = {sensors.Temperature: (20.0, 0.1), sensors.FluidPressure: (101_325, 50)}
