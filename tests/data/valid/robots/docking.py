from composer import AbortedError, CallTimeoutError
from geometry_msgs.msg import Twist, Vector3

STILL = Twist()


def hear(node, message):
    if message.min_range <= message.range <= message.max_range:
        node.state.range = message.range


def may_dock(node, goal):
    if goal.order < 1:
        return 'the number of attempts must be positive'
    return node.state.range < 5.0


def dock(node, goal):
    tries = []
    begin = node.now()
    try:
        while node.state.range > node.parameters.approach:
            elapsed = (node.now() - begin).nanoseconds / 1e9
            if elapsed > node.parameters.timeout:
                raise AbortedError('it takes too long', {'sequence': tries})
            speed = min(0.2, node.state.range / 4)
            node.publish('cmd_vel', Twist(linear=Vector3(x=speed)))
            if len(tries) < goal.order:
                tries.append(int(elapsed))
                yield tries
            else:
                yield
            node.sleep(0.1)
    finally:
        node.publish('cmd_vel', STILL)
    try:
        answer = node.call('charge', True, timeout=2.0)
    except CallTimeoutError:
        node.logger.warning('the charger does not answer')
        return {'sequence': tries}
    if not answer.success:
        node.logger.warning(answer.message)
    return {'sequence': tries}
