"""An executor for any rclpy program, whose cost per event does not grow with the graph.

How it hears of events was decided by measuring (two cores, round trips/s between two nodes):

- One wait set and thread per callback group: 16,000 to 19,000. Each hop is a thread switch, each
  group a thread, and a QoS event in a wait set wakes it for every message of its subscription.
- `rclpy.experimental.EventsExecutor` with finite waits, fed with views of the entities: 50,000.
  But it takes each message out of the middleware at once, so that a slow callback needs a queue
  without bounds; it arms QoS events, whose locks Fast DDS takes in two orders (ros2/rmw_fastrtps
  pull request 890); and it aborts the process if a view outlives it.
- rcl's own announcements, which that executor is built on, taken directly (`rcl`): 40,000, with 0
  or 1,000 other nodes. Nothing is taken before its callback can run, so queues are the QoS depth,
  no lock is shared with the middleware, and it needs nothing experimental. This is what is here.

A datum's way: the middleware adds to an eventfd (`rcl`, `signals`) → the leader's epoll returns
(`engine`) → the source is queued in its group (`schedule`) → claimed, taken and run by the leader
itself (`execution`, `sources`), while a standby watches over the leader (`crew`). Deadlines of
timers are in `alarms`, suspended coroutines in `tasks`, what rcl does not announce in `lane`, and
`registry` compares the nodes' lists of entities with what is listened to. `switching` says how
long a computing callback may hold up the others.

Locks are held for moments and nothing is called under them but the next in this order: `registry`,
`lane`, `crew`, `schedule`, `alarms`, `signals`. A callback, a take and a wait run under none.
"""

from composer.executor.composer_executor import ComposerExecutor
from composer.executor.missed import Missed

__all__ = ['ComposerExecutor', 'Missed']
