import importlib
import json
from array import array
from functools import lru_cache, reduce

import numpy as np


@lru_cache(maxsize=None)
def get_message(identifier):
    package, kind, name = identifier.split('/')
    return getattr(importlib.import_module(f'{package}.{kind}'), name)


def publish_defaults(node, types):
    for name, identifier in types.items():
        message = get_message(identifier)()
        if hasattr(message, 'header'):
            message.header.stamp = node.now().to_msg()
            message.header.frame_id = name
        for field, kind in message.get_fields_and_field_types().items():
            if kind == 'string':
                setattr(message, field, 'text')
        node.publish(name, message)


def to_dict(value):
    if hasattr(value, 'get_fields_and_field_types'):
        return {name: to_dict(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, (list, tuple, array, np.ndarray)):
        return [to_dict(v) for v in value]
    if isinstance(value, bytes):
        return value.hex()
    if isinstance(value, np.generic):
        return value.item()
    return value


def echo(node, message):
    data = to_dict(message)
    node.state.fields = getattr(node.state, 'fields', set()) | set(data)
    return json.dumps(data)


def count_fields(node):
    slots = [s.lstrip('_') for s in get_message('sensor_msgs/msg/Imu').__slots__]
    total = reduce(lambda n, slot: n + bool(slot), slots, 0)
    return total + len(vars(node.state).get('fields', ()))
