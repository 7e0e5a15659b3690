import time

from test_msgs.action import NestedMessage
from test_msgs.msg import BasicTypes, Builtins


def grip(node, goal: NestedMessage.Goal, *, step: float):
    target = goal.nested_field.float64_value
    feedback = NestedMessage.Feedback()
    try:
        while abs(target - node.state.width) > step / 2:
            node.state.width += step if target > node.state.width else -step
            feedback.nested_field.float64_value = node.state.width
            yield feedback
            time.sleep(0.005)
    except GeneratorExit:
        node.state.stopped += 1
        raise
    result = NestedMessage.Result(nested_field=BasicTypes(bool_value=True))
    result.nested_field_no_pkg = Builtins(time_value=node.now().to_msg())
    return result


def width(node):
    return node.state.width


def work(node):
    goals = [NestedMessage.Goal(nested_field=BasicTypes(float64_value=w)) for w in (0.08, 0.02)]
    for goal in goals:
        handle = node.send_goal('grip', goal)
        result = handle.result(timeout=4)
        node.logger.info(f'{handle.status}: {result.nested_field.bool_value} at {result.nested_field_no_pkg.time_value.sec > 0}')
        yield


def on_feedback(node, feedback):
    node.own_state.setdefault('widths', []).append(feedback.nested_field.float64_value)
