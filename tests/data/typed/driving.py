"""Behaviours with errors that a type checker finds: each line that ends in `# error` has one."""

import contextlib

import helping
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool

from composer import Node


def tick(node):
    node.state.count += 1
    node.state.later = node.state.cuont  # error
    node.publish('status', 'on')
    node.publish('statsu', 'on')  # error
    node.publish('status', {'dta': 'on'})  # error
    payload = {'data': 'on'}
    node.publish('status', payload)
    node.publish(f'stat{"us"}', 'on')
    light(node, on=node.parameters.speed > 1)
    if node.parameters['frame.id']:
        helping.warn(node, node.parameters.of_others)
    helping.warn(node, node.parameters.sped)  # error
    return {'linear': {'x': 1, 'yy': 2}}  # error


def obey(node, message):
    node.logger.warnning('moving')  # error
    speed = message.linear.x + message.linaer.x  # error
    message.angular.z = 1  # error
    message.angular.z = 'fast'  # error
    return f'{speed}'


def look(node, scan, longest=LaserScan.LONGEST):  # error
    scan.ranges = [1.0, longest]
    if node.parameters.speed > 2:
        copied = LaserScan(angle_min=node.now())  # error
        copied.header.stamp = node.now()  # error
        copied.header.stamp.seconds = 1  # error
        copied.range_min = node.parameters.mode
        node.logger.info('far', every=2)  # error
        scan.distance = 1.0
    scan.range_maximum = max(scan.ranges)  # error


def light(node, *, on):
    response = node.call('light', {'data': on})
    node.logger.info(response.messge)  # error
    node.call_async('light', True)  # error


def switch(node: Node, request: SetBool.Request) -> SetBool.Response:
    return SetBool.Response(success=request.dota)  # error


def reset(node, request):
    request = request or None
    with contextlib.suppress(AttributeError):
        node.publsh('status', '')
    if hasattr(node.state, 'unheard'):
        node.state.unheard()
    return {'success': True}


def turn(node):
    return node.parameters.radius if node.name == 'left_wheel' else node.parameters.width
