import csv
import math
from pathlib import Path

from sensor_msgs.msg import NavSatFix, NavSatStatus

EARTH_RADIUS = 6_371_000.0


def distance(one: NavSatFix, other: NavSatFix) -> float:
    mean = math.radians((one.latitude + other.latitude) / 2)
    north = math.radians(other.latitude - one.latitude)
    east = math.radians(other.longitude - one.longitude) * math.cos(mean)
    return EARTH_RADIUS * math.hypot(north, east)


class Track:
    def __init__(self, node):
        path = Path(node.parameters.folder) / f'{node.name}.csv'
        self.file = path.open('w', newline='')
        self.writer = csv.writer(self.file)
        self.writer.writerow(['time', 'latitude', 'longitude', 'altitude'])
        self.last = None
        self.length = 0.0

    def hear(self, node, message: NavSatFix):
        if message.status.status == NavSatStatus.STATUS_NO_FIX:
            node.logger.warning('no fix', throttle_duration_sec=10.0)
            return
        if self.last is not None:
            moved = distance(self.last, message)
            if moved < node.parameters.least_distance:
                return
            self.length += moved
        self.last = message
        stamp = message.header.stamp
        self.writer.writerow([stamp.sec, message.latitude, message.longitude, message.altitude])

    def report(self, node):
        self.file.flush()
        return self.length

    def close(self, node):
        self.file.close()
