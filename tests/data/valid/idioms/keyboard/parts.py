import geometry_msgs.msg

msg = """
   u    i    o
   j    k    l
   m    ,    .
"""

moveBindings = {
    'i': (1, 0, 0, 0), 'o': (1, 0, 0, -1), 'j': (0, 0, 0, 1), 'l': (0, 0, 0, -1),
    'u': (1, 0, 0, 1), ',': (-1, 0, 0, 0), '.': (-1, 0, 0, 1), 'm': (-1, 0, 0, -1),
}

speedBindings = {'q': (1.1, 1.1), 'z': (.9, .9), 'w': (1.1, 1), 'x': (.9, 1)}


def vels(speed, turn):
    return 'currently:\tspeed %s\tturn %s ' % (speed, turn)


def banner(node):
    for line in msg.strip('\n').splitlines():
        node.logger.info(line)


def loop(node, keys):
    speed, turn = node.parameters.speed, node.parameters.turn
    x = y = z = th = 0
    stamped = node.parameters.stamped
    TwistMsg = geometry_msgs.msg.TwistStamped if stamped else geometry_msgs.msg.Twist
    twist_msg = TwistMsg()
    if stamped:
        twist = twist_msg.twist
        twist_msg.header.frame_id = node.parameters.frame_id
    else:
        twist = twist_msg
    for key in keys:
        if key in moveBindings.keys():
            x, y, z, th = moveBindings[key]
        elif key in speedBindings.keys():
            speed *= speedBindings[key][0]
            turn *= speedBindings[key][1]
            node.publish('status', vels(speed, turn))
        else:
            x = y = z = th = 0
        twist.linear.x, twist.linear.y, twist.linear.z = x * speed, y * speed, z * speed
        twist.angular.z = th * turn
        node.publish('cmd_vel_stamped' if stamped else 'cmd_vel', twist_msg)
        yield


def drive(node, cmd):
    node.state.moving = cmd != geometry_msgs.msg.Twist()
