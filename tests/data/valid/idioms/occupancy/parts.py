from array import array

import numpy as np
from geometry_msgs.msg import Point, Pose
from nav_msgs.msg import GridCells, MapMetaData, OccupancyGrid

FREE, OCCUPIED, UNKNOWN = 0, 100, -1


def _grid(node):
    if not hasattr(node.state, 'grid'):
        n = node.parameters.size
        node.state.grid = np.full((n, n), UNKNOWN, dtype=np.int8)
    return node.state.grid


def _meta(node):
    n, r = node.parameters.size, node.parameters.resolution
    origin = Pose()
    origin.position.x = origin.position.y = -n * r / 2
    origin.orientation.w = 1.0
    return MapMetaData(map_load_time=node.now().to_msg(), resolution=r, width=n, height=n, origin=origin)


def scan(node):
    ranges = 1.0 + 0.5 * np.random.rand(90)
    return dict(angle_min=-np.pi, angle_max=np.pi, angle_increment=2 * np.pi / 90, range_min=0.1, range_max=3, ranges=ranges)


def mark(node, msg):
    grid, r = _grid(node), node.parameters.resolution
    angles = np.linspace(msg.angle_min, msg.angle_max, len(msg.ranges), endpoint=False)
    for fraction, value in ((0.5, FREE), (1.0, OCCUPIED)):
        xy = fraction * np.asarray(msg.ranges)[:, None] * np.c_[np.cos(angles), np.sin(angles)]
        cells = np.floor(xy / r).astype(int) + grid.shape[0] // 2
        inside = ((cells >= 0) & (cells < grid.shape[0])).all(axis=1)
        grid[cells[inside, 1], cells[inside, 0]] = value


def _to_msg(node):
    msg = OccupancyGrid(info=_meta(node))
    msg.header.frame_id, msg.header.stamp = 'map', node.now().to_msg()
    msg.data = array('b', _grid(node).ravel().tobytes())
    return msg


def publish_map(node):
    return _to_msg(node)


def get_map(node, _request):
    return _to_msg(node)


def stats(node, msg):
    cells = np.array(msg.data, dtype=np.int8).reshape(msg.info.height, msg.info.width)
    node.state.known = float((cells != UNKNOWN).mean())


def fetch(node):
    grid = node.call('map_server/map', {}).map
    cells = GridCells(header=grid.header, cell_width=grid.info.resolution, cell_height=grid.info.resolution)
    occupied = np.argwhere(np.array(grid.data).reshape(grid.info.height, -1) == OCCUPIED)
    cells.cells = [Point(x=float(x), y=float(y)) for y, x in occupied * grid.info.resolution]
    node.logger.info(f'{len(cells.cells)} cells, {getattr(node.state, "known", 0):.0%} known')
    return cells
