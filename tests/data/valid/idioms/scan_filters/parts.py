import math
from array import array
from inspect import signature

import numpy as np
from sensor_msgs.msg import LaserEcho, LaserScan, MultiEchoLaserScan

FILTERS = {}


def laser_filter(function):
    FILTERS[function.__name__.strip('_')] = function, list(signature(function).parameters)[1:]
    return function


@laser_filter
def range_(ranges, lower, upper):
    return np.where((ranges < lower) | (ranges > upper), np.nan, ranges)


@laser_filter
def median(ranges, size):
    return np.nanmedian(np.lib.stride_tricks.sliding_window_view(np.pad(ranges, size // 2, 'edge'), size), axis=1)


@laser_filter
def shadow(ranges, *, jump):
    jumps = np.abs(np.diff(ranges, append=ranges[-1])) > jump
    return np.ma.masked_where(jumps, ranges).filled(np.inf)


def _base(cls):
    return cls(angle_min=-math.pi, angle_max=math.pi, angle_increment=math.tau / 36, range_min=0.0, range_max=10.0)


def scan(node):
    msg = _base(LaserScan)
    msg.ranges = (np.random.rand(36) * 4 + 0.5).tolist()
    return msg


def echoes(node):
    msg = _base(MultiEchoLaserScan)
    msg.ranges = [LaserEcho(echoes=[1.0 + i / 10, 2]) if False else LaserEcho(echoes=[1.0 + i / 10, 2.0]) for i in range(36)]
    return msg


def apply(node, msg):
    ranges = np.array(msg.ranges)
    for name in node.parameters.chain:
        function, arguments = FILTERS[name]
        ranges = function(ranges, **{a: node.parameters[f'{name}.{a}'] for a in arguments})
    msg.ranges = array('f', ranges)
    msg.intensities = []
    return msg


def first_echo(node, msg):
    common = set(LaserScan.get_fields_and_field_types()) & set(msg.get_fields_and_field_types()) - {'ranges', 'intensities'}
    out = LaserScan(**{name: getattr(msg, name) for name in common})
    out.ranges.fromlist([e.echoes[0] if e.echoes else math.inf for e in msg.ranges])
    return out
