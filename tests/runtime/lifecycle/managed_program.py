"""A plain managed node of rclpy: `managed_program.py NAME [KEY=OUTCOME]…`.

KEY is a callback, as `on_configure`; OUTCOME is `failure`, `error`, `exit` or `hang`.
"""

import os
import sys
import threading
from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

OUTCOMES = dict(argument.split('=') for argument in sys.argv[2:] if '=' in argument)


class Managed(LifecycleNode):
    def end(self, key):
        sys.stdout.write(f'{key}\n')
        sys.stdout.flush()
        outcome = OUTCOMES.get(key)
        if outcome == 'exit':
            os._exit(3)
        if outcome == 'hang':
            threading.Event().wait()
        if outcome == 'error':
            raise OSError(key)
        good = outcome != 'failure'
        return TransitionCallbackReturn.SUCCESS if good else TransitionCallbackReturn.FAILURE

    def on_configure(self, state):
        return self.end('on_configure')

    def on_activate(self, state):
        return self.end('on_activate')

    def on_deactivate(self, state):
        return self.end('on_deactivate')

    def on_cleanup(self, state):
        return self.end('on_cleanup')


sys.stdout.write(f'pid {os.getpid()}\n')
sys.stdout.flush()
rclpy.init()
node = Managed(sys.argv[1])
executor = MultiThreadedExecutor()
executor.add_node(node)
with suppress(KeyboardInterrupt, ExternalShutdownException):
    executor.spin()
