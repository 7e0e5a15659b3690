from geometry_msgs.msg import Twist, Vector3
from std_msgs.msg import Float64MultiArray, String


def feed(node):
    message = node.own_state.get('count', 0)
    node.own_state['count'] = message + 1
    message = ','.join(str(message + i / 2) for i in range(3))
    message = String(data=message)
    return message


def parse(node, message):
    message = message.data
    message = message.split(',')
    message = [float(m) for m in message]
    message, values = Float64MultiArray(), message
    message.data = values
    message.layout.dim = []
    return message


def summarise(node, message):
    data = message.data
    for message in data:
        if message < 0:
            break
    else:
        message = sum(data) / max(len(data), 1)
    del data
    node.publish('text', str(message))
    return message


def rebind(node):
    out = None
    for out in (1, 'two', 3.0):
        node.state.last = out
    node.state.last = []
    node.state.last.append(out)
    out = dict(x=out)
    out = Vector3(**out)
    out = Twist(linear=out)
    if node.state.last:
        node, publish = None, node.publish
        publish('twist', out)
        out = None
    return out


def evaluate(node, request):
    request, response = request.string_value, {}
    try:
        response = float(request)
    except ValueError as response:
        return {'string_value': str(response)}
    return {'float64_value': response, 'bool_value': True}


def ask(node):
    node = node, node.own_state
    for node, _ in (node,):
        response = [node.call('evaluate', {'string_value': text}) for text in ('1.5', 'x')]
        response = {r.bool_value: r for r in response}
        response = response[False].string_value, response[True].float64_value
    node.logger.debug(f'{response}')
