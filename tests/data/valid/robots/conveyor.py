from std_msgs.msg import Int32MultiArray, MultiArrayDimension


def barrier(node, message):
    if message.data:
        node.state.seen += 1
        node.state.last = node.now()


def weigh(node, message, low: float, high: float):
    if low <= message.data <= high:
        return
    node.state.rejected += 1
    node.publish('reject', None or {})
    node.logger.info(f'{message.data:.2f} kg is not in [{low}, {high}]')


def watch(node):
    if not node.state.running or node.state.last is None:
        return
    idle = (node.now() - node.state.last).nanoseconds * 1e-9
    if idle > node.parameters.jam_after:
        node.logger.error(f'nothing for {idle:.1f} s: jammed?')
        set_speed(node, 0.0)


def set_speed(node, speed):
    node.state.running = speed > 0
    node.publish('belt', {'data': speed * node.parameters.pitch})


def count(node):
    message = Int32MultiArray()
    message.layout.dim.append(MultiArrayDimension(label='count', size=2, stride=2))
    message.data = [node.state.seen, node.state.rejected]
    return message


def run(node, request):
    set_speed(node, 1.0 if request.data else 0.0)
    return {'success': node.state.running == request.data}
