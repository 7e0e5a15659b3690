from __future__ import annotations

from typing import Literal


def sample(node, offset: float, unit: Literal['celsius', 'kelvin'] = 'celsius'):
    value = node.parameters.target + offset
    node.state.samples.append(value)
    node.publish('alarm', value > node.parameters.limits[1])
    node.publish('mean', {'data': sum(node.state.samples) / len(node.state.samples)})
    node.logger.debug(
        f'{unit} {node.parameters.unit} {node.parameters.hysteresis} {node.state.alarm}'
    )
    return {'temperature': value, 'variance': 0.5, 'header': {'frame_id': 'bench'}}


def note(node, message, weights: list[float], labels: dict[str, str]):
    name = labels['low'] if message.relative_humidity * weights[0] < 0.2 else labels['high']
    node.logger.debug(
        f'{name} {node.parameters.names} {node.parameters["pid.gain"]} {node.parameters["pid.windup"]}'
    )


def calibrate(node, request):
    node.send_goal('water', {'order': 3})
    return {'success': True, 'message': node.parameters.note or ''}


def flow(node, feedback):
    node.logger.info(f'{list(feedback.sequence)}')


def wet(node, result):
    node.logger.info(f'{list(result.sequence)}')


def tune(node, changes):
    return 'too hot' if changes.get('target', 0) > 35 else None


def report(node, *, verbose: bool):
    node.logger.info(f'bye {verbose}')


def fill(node, message):
    node.logger.debug(f'{message.data}')


def stop(node, message):
    node.logger.warning(f'{message.data}')


def water(node, goal, rate: float):
    sequence = [0]
    for index in range(goal.order):
        sequence.append(int(index * rate))
        yield sequence
    return sequence


def may(node, goal):
    return goal.order < 30


def ask(node):
    response = node.call('calibrate', {})
    node.logger.info(response.message)


def adapt(node, message, index: int):
    node.logger.debug(
        f'{index} {node.parameters.index} {node.parameters.kind} {message.temperature}'
    )
