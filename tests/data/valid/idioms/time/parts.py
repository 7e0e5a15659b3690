import time
from datetime import datetime, timezone

from builtin_interfaces.msg import Time as TimeMsg
from rclpy.duration import Duration
from rclpy.time import Time
from rosgraph_msgs.msg import Clock


def tick(node):
    start = node.own_state.setdefault('start', time.monotonic())
    elapsed = 2 * (time.monotonic() - start)
    sec = int(elapsed)
    return Clock(clock=TimeMsg(sec=100 + sec, nanosec=int((elapsed - sec) * 1e9)))


def reference(node):
    sec, nanosec = divmod(time.time_ns(), 10**9)
    wall = datetime.fromtimestamp(sec, tz=timezone.utc)
    return {'header': {'stamp': node.now()}, 'time_ref': {'sec': sec, 'nanosec': nanosec}, 'source': wall.isoformat()}


def span(node):
    now = node.now()
    first = vars(node.state).setdefault('first', now)
    if now < first + Duration(seconds=0.1):
        return None
    assert now > first and isinstance(now - first, Duration) and now - Duration(nanoseconds=5) != now
    later = Time(seconds=now.nanoseconds // 10**9, clock_type=now.clock_type)
    return max(now - later, Duration()).to_msg()
