import struct
import sys

import numpy as np
from geometry_msgs.msg import Point32, Polygon
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

_DATATYPES = {
    PointField.INT8: ('b', 1), PointField.UINT8: ('B', 1), PointField.INT16: ('h', 2), PointField.UINT16: ('H', 2),
    PointField.INT32: ('i', 4), PointField.UINT32: ('I', 4), PointField.FLOAT32: ('f', 4), PointField.FLOAT64: ('d', 8),
}


def _fields(**kinds):
    offset = 0
    for name, kind in kinds.items():
        yield PointField(name=name, offset=offset, datatype=kind, count=1)
        offset += _DATATYPES[kind][1]


def create_cloud(header, fields, rows):
    fmt = '<' + ''.join(_DATATYPES[f.datatype][0] for f in fields)
    step = struct.calcsize(fmt)
    buffer = bytearray(step * len(rows))
    for i, row in enumerate(rows):
        struct.pack_into(fmt, buffer, i * step, *row)
    return PointCloud2(
        header=header, height=1, width=len(rows), fields=fields, is_dense=True,
        is_bigendian=sys.byteorder != 'little', point_step=step, row_step=step * len(rows), data=buffer,
    )


def read_points(cloud, names=('x', 'y', 'z')):
    dtype = np.dtype({
        'names': [f.name for f in cloud.fields],
        'formats': [_DATATYPES[f.datatype][0] for f in cloud.fields],
        'offsets': [f.offset for f in cloud.fields],
        'itemsize': cloud.point_step,
    })
    structured = np.frombuffer(bytes(cloud.data), dtype)
    return np.stack([structured[n] for n in names], axis=-1)


def shoot(node):
    header = Header(stamp=node.now().to_msg(), frame_id='depth')
    fields = list(_fields(x=PointField.FLOAT32, y=PointField.FLOAT32, z=PointField.FLOAT32, ring=PointField.UINT16))
    rows = [(*p, i % 16) for i, p in enumerate(np.random.rand(40, 3))]
    return create_cloud(header, fields, rows)


def cluster(node, cloud):
    points = read_points(cloud)
    if not len(points):
        return None
    cells = np.floor(points / node.parameters.voxel).astype(int)
    unique, inverse, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    center = points.mean(axis=0)
    node.publish('centroid', {'header': cloud.header, 'point': {a: c for a, c in zip('xyz', center)}})
    corners = [Point32(x=float(x), y=float(y)) for x, y in (points.min(0)[:2], points.max(0)[:2])]
    node.publish('hull', {'header': cloud.header, 'polygon': Polygon(points=corners)})
    return [_marker(cloud.header, i, points[inverse.ravel() == i], n) for i, n in enumerate(counts) if n >= node.parameters.min_points]


def _marker(header, ident, members, n):
    marker = Marker(header=header, ns='clusters', id=ident, type=Marker.CUBE, action=Marker.ADD)
    low, high = members.min(axis=0), members.max(axis=0)
    for axis, lo, hi in zip('xyz', low, high):
        setattr(marker.pose.position, axis, float(lo + hi) / 2)
        setattr(marker.scale, axis, float(hi - lo) or 0.01)
    marker.pose.orientation.w = 1.0
    marker.color = ColorRGBA(r=min(1.0, n / 10), g=0.2, b=0.2, a=0.8)
    marker.lifetime.nanosec = 200_000_000
    return marker
