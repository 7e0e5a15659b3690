from __future__ import annotations

import time

import numpy as np
from geometry_msgs.msg import Point
from rclpy.duration import Duration
from weld_interfaces.action import Weld
from weld_interfaces.msg import Seam
from weld_interfaces.srv import Plan


def seam(node) -> Seam:
    msg = Seam(mode=Seam.MODE_LINE)
    msg.start = np.zeros(3, np.float32)
    msg.start[0] = 1
    msg.heights = [0.5, 1.0]
    msg.flags[1] = True
    msg.pause = Duration(seconds=0.25).to_msg()
    msg.points = [Point(x=1.0)]
    assert msg.name == Seam.DEFAULT_NAME
    return msg


def on_seam(node, msg: Seam) -> None:
    x, y, z = msg.start
    node.state.last = dict(start=(float(x), y, z), mode={Seam.MODE_SPOT: 'spot', Seam.MODE_LINE: 'line'}[msg.mode], flags=all(msg.flags))


def plan(node, request: Plan.Request) -> Plan.Response | dict:
    if not request.seams:
        return {}
    lengths = [float(np.linalg.norm(s.start)) for s in request.seams]
    response = Plan.Response(longest=request.seams[int(np.argmax(lengths))])
    response.duration = Duration(seconds=sum(lengths) / request.speed).to_msg()
    return response


def weld(node, goal: Weld.Goal):
    for i, height in enumerate(goal.seam.heights, 1):
        yield i / len(goal.seam.heights)
        time.sleep(0.01 * height)
    return len(goal.seam.heights)


def work(node):
    one = {'start': [3, 0, 4], 'heights': (1, 2, 3), 'points': [{'x': 1}, {}]}
    answer = node.call('plan', {'seams': [one, one | {'name': 'other', 'mode': Seam.MODE_SPOT}]})
    node.logger.info(f'{answer.duration.sec} s, {answer.longest.name}')
    yield
    result = node.send_goal('weld', {'seam': one}).result(timeout=3)
    node.logger.info(f'{result.drops} drops')


def on_feedback(node, feedback: Weld.Feedback):
    node.state.progress = max(getattr(node.state, 'progress', 0), feedback.progress)
