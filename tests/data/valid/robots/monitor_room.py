from collections import defaultdict, deque
from statistics import fmean

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue


def begin_readings(node):
    if not hasattr(node.state, 'readings'):
        node.state.readings = defaultdict(lambda: deque(maxlen=node.parameters.window))
    return node.state.readings


def hear(node, message, name):
    readings = begin_readings(node)[name]
    readings.append(message.temperature)
    limit = node.parameters[f'limits.{name}']
    was_hot = node.own_state.get('hot', False)
    is_hot = fmean(readings) > limit
    if is_hot and not was_hot:
        node.publish('alarm', f'{name}: {fmean(readings):.1f} > {limit}')
    node.own_state['hot'] = is_hot


def status_of(node, name, readings):
    status = DiagnosticStatus(name=f'room/{name}', hardware_id=name)
    if not readings:
        status.level, status.message = DiagnosticStatus.STALE, 'no reading'
        return status
    mean = fmean(readings)
    is_hot = mean > node.parameters[f'limits.{name}']
    status.level = DiagnosticStatus.WARN if is_hot else DiagnosticStatus.OK
    status.message = 'too hot' if is_hot else 'ok'
    status.values.append(KeyValue(key='mean', value=f'{mean:.2f}'))
    return status


def report(node):
    array = DiagnosticArray()
    array.header.stamp = node.now().to_msg()
    readings = begin_readings(node)
    array.status = [status_of(node, name, readings[name]) for name in node.parameters.names]
    return array
