import contextlib


def say(node):
    node.publish('a', 'to all')
    if node.name == 'first':
        node.publish('b', 'only here')
    for topic in ('a', 'b'):
        if any(p.topic_name.endswith(f'/{topic}') for p in node.ros.publishers):
            node.publish(topic, 'where it exists')
    with contextlib.suppress(Exception):
        node.publish('b', 'if possible')
    try:
        node.publish('b', 'if possible')
    except Exception:
        node.logger.debug('no b here')
