"""Recordings to read, and messages with something in each field."""

from functools import partial
from itertools import count

from composer.interfaces.class_fields import describe_class
from composer.interfaces.classes import import_interface, interface_name

SCALARS = {
    'bool': lambda number: bool(number % 2),
    'byte': lambda number: bytes([number % 256]),
    'char': lambda number: number % 256,
    'float32': lambda number: number / 4,
    'float64': lambda number: number / 3,
    'string': lambda number: f'ü{number}',
    'wstring': lambda number: f'語{number}',
}
QOS = {
    'history': 'keep_last',
    'depth': 10,
    'reliability': 'reliable',
    'durability': 'volatile',
    'deadline': 2**63 - 1,
    'lifespan': 2**63 - 1,
    'liveliness': 'automatic',
    'liveliness_lease_duration': 2**63 - 1,
}


def filled(message_class, numbers=None):
    """Return a message whose fields have values that differ."""
    numbers = numbers or count(1)
    message = message_class()
    for field in describe_class(message_class).fields:
        setattr(message, field.name, _value(field.type, numbers))
    return message


def _value(field, numbers):
    if field.array is not None:
        size = 3 if field.array_bound is None else min(3, field.array_bound)
        size = field.array_bound if field.array == 'fixed' else size
        return [_value(field.item, numbers) for _ in range(size)]
    if field.nested:
        return filled(import_interface(field.nested), numbers)
    number = next(numbers)
    value = SCALARS[field.kind](number) if field.kind in SCALARS else number % 100
    return value[: field.string_bound] if field.string_bound else value


def described(kind):
    from composer.recordings import metadata
    from composer.recordings.definitions import full_definition, type_hash

    about = {metadata.QOS_KEY: metadata.render_qos([QOS]), metadata.HASH_KEY: type_hash(kind)}
    return interface_name(kind), 'ros2msg', full_definition(kind).encode(), about


def write_recording(path, topics, *, chunks=1, closes=True):
    """Write an MCAP file, and return it.

    Args:
        topics: Messages by topic; they are published one ns after the other.
        chunks: Among how many chunks they are distributed.
        closes: Whether the file is completed.
    """
    from rclpy.serialization import serialize_message

    from composer.recordings.mcap_writer import McapWriter

    with path.open('wb', buffering=0) as stream:
        writer = McapWriter(stream, 'test')
        entries = []
        for topic, messages in topics.items():
            kind = type(messages[0])
            channel = writer.add_channel(topic, partial(described, kind))
            entries += [(channel, serialize_message(each)) for each in messages]
        size = -(-len(entries) // chunks)
        for number, (channel, data) in enumerate(entries):
            writer.add_messages([(channel, 1000 + number, 900 + number, data)])
            if number % size == size - 1:
                writer.flush()
        if closes:
            writer.finish({})
        else:
            writer.flush()
    return path
