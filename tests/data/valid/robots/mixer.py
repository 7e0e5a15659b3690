from rclpy.duration import Duration


def hear(node, message, source):
    node.state.heard[source] = node.now()
    if node.state.locked:
        return
    chosen = choose(node)
    if chosen != node.state.chosen:
        node.state.chosen = chosen
        node.publish('active', chosen or 'none')
    if chosen == source:
        node.publish('cmd_vel', message)


def choose(node):
    timeout = Duration(seconds=node.parameters.timeout)
    now = node.now()
    for source in node.parameters.priorities:
        heard = node.state.heard.get(source)
        if heard is not None and now - heard < timeout:
            return source
    return ''


def lock(node, message):
    node.state.locked = message.data
    if message.data:
        node.publish('cmd_vel', {})
        node.logger.warning('locked')
