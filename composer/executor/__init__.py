"""An executor for any rclpy program, whose cost per event does not grow with the graph.

How it gets its events was decided by measuring (two cores, round trips/s between two nodes):

- One wait set and thread per callback group: 16,000 to 19,000. Each hop is a thread switch, each
  group a thread, and a QoS event in a wait set wakes it for every message of its subscription.
- `rclpy.experimental.EventsExecutor` with finite waits, which is given views of the entities:
  50,000. But it takes each message out of the middleware at once, so a slow callback needs a queue
  without bounds; it arms QoS events, whose locks Fast DDS takes in two orders (ros2/rmw_fastrtps
  pull request 890); and it aborts the process if a view outlives it.
- rcl's event callbacks, on which that executor is built, used directly (`c_bindings`): 40,000,
  with 0 or 1,000 other nodes. Nothing is taken before its callback can run, so queues are the QoS
  depth, no lock is shared with the middleware, and nothing experimental is needed. This is used.

The way of a message:

1. The middleware adds to the eventfd of the subscription (`c_bindings`, `event_fds`).
2. The leader's wait on an epoll returns, and the source of that subscription is told
   (`event_poller`).
3. The source is queued, or parked if its callback group is busy (`scheduler`).
4. The leader starts it, and executes it itself (`event_loop`), while a standby thread waits to
   take over if the callback is slow (`worker_threads`).
5. The source takes the message and calls the callback (`event_source`, `entity_sources`,
   `waitable_sources`).
6. If the callback awaits something, the rest of it comes back through the scheduler as a task
   (`tasks`).

What is handed over within the process (`inbox`) begins at step 3. While something is ready, or
comes, the leader stays at steps 2 to 5, for half a millisecond at a time; then it looks at all
else, such as a stop. Events are put down without a lock (`Scheduler.add_events`).

Beside that way: `deadlines` makes timers ready, `qos_events` QoS events, `wait_set_thread` all
else that is not announced, and `entity_registry` keeps the sources in step with the entities of
the nodes. `spinner` puts these parts together for `composer_executor`, whose methods are rclpy's.
`after_fork` says what a forked child does with all this, and `switch_interval` how long a
computing callback may hold up the others.

Locks are held for moments, and nothing is called under them but the next in this order:
`entity_registry`, `wait_set_thread`, `worker_threads`, `scheduler`, `deadlines`, `event_fds`.
Callbacks, takes and waits run under none.
"""

import rclpy.executors

from composer.errors import ComposerError

if not hasattr(rclpy.executors, 'TimeoutObject'):
    # Before the imports that an older rclpy breaks.
    message = 'the executor needs rclpy 7.1 (ROS 2 Jazzy) or newer, and this one is older'
    raise ComposerError(message, help='source a newer ROS 2, or install its rclpy')

from composer.executor.composer_executor import ComposerExecutor
from composer.executor.descriptors import LostDescriptorError
from composer.executor.sources.qos_events import checked_seldom

__all__ = ['ComposerExecutor', 'LostDescriptorError', 'checked_seldom']
