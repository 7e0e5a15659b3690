"""Messages of plain classes: expectations ask for no more than names and types of fields."""

from array import array
from typing import ClassVar


class Message:
    """A message with the fields that a class lists."""

    FIELDS: ClassVar = {}

    def __init__(self, **values):
        for name, value in values.items():
            setattr(self, name, value)

    @classmethod
    def get_fields_and_field_types(cls):
        return dict(cls.FIELDS)

    def __eq__(self, other):
        return vars(self) == vars(other)

    __hash__ = None


class Number(Message):
    """As `std_msgs/msg/Float64`."""

    FIELDS: ClassVar = {'data': 'double'}


class Vector(Message):
    """As `geometry_msgs/msg/Vector3`, with 32 bits."""

    FIELDS: ClassVar = {'x': 'float', 'y': 'float'}


class Scan(Message):
    """As `sensor_msgs/msg/LaserScan`, in short."""

    FIELDS: ClassVar = {'origin': 'example/Vector', 'ranges': 'sequence<float>', 'frame': 'string'}


class Status(Message):
    """As `diagnostic_msgs/msg/DiagnosticStatus`, in short: a `byte` is `bytes` in rclpy."""

    FIELDS: ClassVar = {'level': 'octet', 'flags': 'sequence<octet>'}


def number(value):
    return Number(data=value)


def scan(x=0.0, ranges=(), frame='laser'):
    return Scan(origin=Vector(x=x, y=0.0), ranges=array('f', ranges), frame=frame)
