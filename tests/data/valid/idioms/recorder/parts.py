from typing import Any, NamedTuple

from rclpy.serialization import deserialize_message, serialize_message


class Record(NamedTuple):
    topic: str
    kind: type
    data: bytes
    stamp: int


def source(node, value: Any):
    return value


def record(node, message: Any, topic: str) -> None:
    records = node.state.records
    records.append(Record(topic, message.__class__, serialize_message(message), node.now().nanoseconds))
    del records[:-node.parameters.limit]


def replay(node, request):
    for topic, kind, data, _ in list(node.state.records):
        node.publish(f'replay_{topic}', deserialize_message(data, kind))
    topics = sorted({r.topic for r in node.state.records})
    return {'success': bool(topics), 'message': ' '.join(topics)}


def size(node):
    return sum(len(r.data) for r in node.state.records)


def trigger(node):
    node.logger.info(node.call('replay', {}).message)
