import numpy as np
from geometry_msgs.msg import Point32, PolygonStamped


def configure(node):
    node.state.background = None
    node.state.images = node.state.bad = 0
    return True


def activate(node):
    node.logger.info('inspecting')


def cleanup(node):
    node.state.background = None


def inspect(node, message):
    if message.encoding != 'mono8':
        node.logger.error(f'cannot read {message.encoding}', once=True)
        return
    image = np.frombuffer(message.data, np.uint8).reshape(message.height, message.width)
    if node.state.background is None:
        node.state.background = image.astype(np.float32)
        return
    difference = np.abs(image - node.state.background)
    node.state.background += 0.05 * (image - node.state.background)
    node.state.images += 1
    rows, columns = np.nonzero(difference > node.parameters.threshold)
    if rows.size == 0:
        return
    node.state.bad += 1
    polygon = PolygonStamped(header=message.header)
    corners = [(columns.min(), rows.min()), (columns.max(), rows.max())]
    polygon.polygon.points = [Point32(x=float(x), y=float(y)) for x, y in corners]
    node.publish('defects', polygon)


def report(node):
    total = getattr(node.state, 'images', 0)
    return node.state.bad / total if total else None
