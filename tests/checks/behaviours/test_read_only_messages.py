"""A behaviour of a `read_only` subscription that writes to its messages is found, copies are not."""

import pytest

SYSTEM = """
  filter:
    subscriptions:
      scan:
        type: {type}
        behaviour: parts:hear
        read_only: {read_only}
        publish: out
        external: true
    publishers:
      out: {{type: {type}, external: true}}
"""
HEAD = """
import bisect
import copy
import heapq
import random
import struct
import cv2
import numpy as np
from functools import partial
from geometry_msgs.msg import Pose, PoseArray
from sensor_msgs.msg import CameraInfo, Image, LaserScan
from std_msgs.msg import Header


class Keeper:
    def __init__(self, message):
        self.message = message

    def stamp(self, node):
        self.message.header.stamp = node.now().to_msg()


def stamp(node, message):
    message.header.stamp = node.now().to_msg()
    return message


def first(messages):
    return messages[0]


"""
TYPES = {
    'image': 'sensor_msgs/msg/Image',
    'scan': 'sensor_msgs/msg/LaserScan',
    'poses': 'geometry_msgs/msg/PoseArray',
    'camera': 'sensor_msgs/msg/CameraInfo',
}
WRITES = [
    'scan: scan.range_max = 2.0',
    'scan: scan.header.stamp.sec = 2',
    'scan: scan.ranges[0] = 2.0',
    'scan: scan.ranges.append(2.0)',
    'scan: ranges = scan.ranges; ranges.extend([1.0])',
    'scan: header = scan.header if scan.ranges else scan.header; header.frame_id = "map"',
    'scan: stamp(node, scan)',
    'scan: Keeper(scan).stamp(node)',
    """scan:
        for scan.range_max in (1.0, 2.0):
            pass""",
    """scan:
        def later():
            scan.range_max = 2.0
        node.state.later = later""",
    """scan:
        try:
            scan.range_max = 2.0
        except Exception:
            pass""",
    'poses: poses.poses[0].position.x = 1.0',
    'poses: poses.poses.sort(key=str)',
    """poses:
        for pose in poses.poses:
            pose.position.x += 1.0""",
    'camera: camera.k[0] = 1.0',
    'camera: camera.k.flat[0] = 1.0',
    'camera: camera.k.fill(0.0)',
]
READS = [
    'scan: return scan',
    'scan: node.publish("out", scan)',
    'scan: other = copy.deepcopy(scan); other.range_max = 2.0; return other',
    'scan: scan = copy.deepcopy(scan); scan.header.stamp = node.now().to_msg(); return scan',
    'scan: other = LaserScan(header=scan.header, ranges=scan.ranges); other.range_max = 2.0',
    'scan: return stamp(node, copy.deepcopy(scan))',
    'scan: scan = LaserScan(); scan.range_max = 2.0',
    'scan: limit = scan.range_max; limit += 2.0',
    'scan: ranges = copy.copy(scan.ranges); ranges.append(1.0)',
    'scan: ranges = scan.ranges + scan.ranges; ranges[0] = 1.0',
    'scan: values = np.array(scan.ranges); values *= 2',
    'scan: value = np.asarray(scan.ranges)[0]; value += 1',
    'scan: scan.ranges.index(1.0); scan.ranges.count(1.0); scan.header.frame_id.upper()',
    'scan: header = copy.deepcopy(scan.header); header.frame_id = "map"',
    'scan: node.state.last = scan; node.state.last = None',
    'scan: node.state.ranges = [*scan.ranges]; node.state.ranges.append(1.0)',
    'scan: other = Keeper(copy.deepcopy(scan)); other.stamp(node)',
    """scan:
        if scan.range_max > 2.0:
            scan = copy.deepcopy(scan)
        if scan.range_max > 2.0:
            scan.range_max = 2.0""",
    'poses: found = [copy.deepcopy(pose) for pose in poses.poses]; found[0].position.x = 1.0',
    """poses:
        found = []
        for pose in poses.poses:
            moved = Pose(orientation=pose.orientation)
            moved.position.x = pose.position.x + 1.0
            found.append(moved)
        found.reverse()""",
    'camera: matrix = camera.k.copy(); matrix[0] = 1.0',
    'camera: matrix = camera.k * 2; matrix[0] = 1.0; matrix *= 2',
    'camera: matrix = camera.k.reshape(3, 3).copy(); matrix[0, 0] = 1.0',
    'camera: fx = camera.k[0]; fx *= 2',
    'camera: np.multiply(camera.k, 2, out=np.zeros(9))',
    'image: pixels = np.frombuffer(image.data, np.uint8).copy(); pixels[0] = 1',
    'image: pixels = np.frombuffer(bytes(image.data), np.uint8); pixels[0] = 1',
    'image: pixels = cv2.blur(np.frombuffer(image.data, np.uint8), (3, 3)); pixels[0] = 1',
    'image: octets = bytearray(image.data); octets[0] = 1; octets.append(2)',
]


def _find(check, case, *, read_only=True):
    """Return the rules of the findings in the behaviour."""
    name, _, body = case.partition(':')
    text = body.strip(' ').strip('\n') if '\n' in body else f'        {body.strip()}'
    code = f'{HEAD}def hear(node, {name}):\n{text}\n'
    nodes = SYSTEM.format(type=TYPES[name], read_only=str(read_only).lower())
    return [rule for _, rule in check(nodes, code) if rule != 'missing-module']


@pytest.mark.sampled
@pytest.mark.parametrize('case', WRITES)
def test_writes_to_the_message_are_found(check, case):
    assert set(_find(check, case)) == {'read-only-message'}
    assert 'read-only-message' not in _find(check, case, read_only=False)


@pytest.mark.parametrize('case', READS)
def test_reads_and_writes_to_copies_are_not(check, case):
    assert _find(check, case) == []
