import collections
import math
import operator
from functools import reduce

from geometry_msgs.msg import PointStamped, PoseStamped
from nav_msgs.msg import Path
from sensor_msgs.msg import NavSatFix, NavSatStatus

R = 6_378_137.0
VALID = {NavSatStatus.STATUS_FIX, NavSatStatus.STATUS_SBAS_FIX, NavSatStatus.STATUS_GBAS_FIX}
SERVICES = reduce(operator.or_, (getattr(NavSatStatus, f'SERVICE_{s}') for s in ('GPS', 'GLONASS', 'GALILEO')))


def make_fix(node):
    seq = node.own_state.setdefault('seq', 0)
    node.own_state['seq'] += 1
    msg = NavSatFix()
    msg.header.stamp = node.now().to_msg()
    msg.header.frame_id = 'gps'
    for field in ('latitude', 'longitude', 'altitude'):
        setattr(msg, field, node.parameters[f'start.{field}'] + seq * 1e-6)
    msg.status.status = NavSatStatus.STATUS_FIX if seq else NavSatStatus.STATUS_NO_FIX
    msg.status.service = SERVICES
    msg.position_covariance_type = NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN
    msg.position_covariance[0::4] = [4.0, 4.0, 9.0]
    node.publish('nmea', '$' + (body := f'GPGLL,{msg.latitude:.4f},N') + f'*{reduce(operator.xor, body.encode()):02X}')
    return msg


def to_local(node, fix):
    if fix.status.status not in VALID:
        return
    origin = vars(node.state).setdefault('origin', fix)
    dlat, dlon = (math.radians(getattr(fix, f) - getattr(origin, f)) for f in ('latitude', 'longitude'))
    out = PointStamped(header=fix.header)
    out.header.frame_id = 'map'
    out.point.x = R * dlon * math.cos(math.radians(origin.latitude))
    out.point.y = R * dlat
    out.point.z = fix.altitude - origin.altitude
    if not hasattr(node.state, 'track'):
        node.state.track = collections.deque(maxlen=100)
    node.state.track.append(out)
    return out


def trail(node):
    track = vars(node.state).get('track')
    if not track:
        return None
    path = Path(header=track[-1].header)
    for p in track:
        stamped = PoseStamped(header=p.header)
        stamped.pose.position = p.point
        path.poses.append(stamped)
    return path
