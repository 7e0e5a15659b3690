from std_msgs.msg import String


def create(node):
    ros = node.ros
    node.state.extra = ros.create_publisher(String, '~/extra', 10)
    node.state.clock = ros.get_clock()
    node.state.period = ros.get_parameter('period').get_parameter_value().double_value


def talk(node):
    node.state.extra.publish(String(data='beside'))
    return f'{node.ros.get_fully_qualified_name()} {node.state.clock.now().nanoseconds}'


def hear(node, message):
    name, stamp = message.data.split()
    node.state.age = node.now().nanoseconds - int(stamp)
    if node.state.period > 0 and name == node.ros.get_namespace() + node.name:
        node.logger.debug(f'{node.state.age} ns')


def names(node):
    if not node.ros.count_subscribers('out'):
        return
    topics = dict(node.ros.get_topic_names_and_types())
    return ' '.join(sorted(t for t, kinds in topics.items() if 'std_msgs/msg/String' in kinds))


def destroy(node):
    node.ros.destroy_publisher(node.state.extra)
    del node.state.extra
