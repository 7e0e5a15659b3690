"""A plain managed node of rclpy: `managed_program.py NAME [KEY=OUTCOME]…`.

KEY is a callback, as `on_configure`; OUTCOME is `failure` or `error`.
"""

import os
import sys
from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

from composer.executor import ComposerExecutor

RCLError = rclpy_implementation.RCLError
NAME = sys.argv[1]
OUTCOMES = dict(argument.split('=') for argument in sys.argv[2:] if '=' in argument)


class Managed(LifecycleNode):
    def _LifecycleNodeMixin__change_state(self, transition):  # noqa: N802 - rclpy's name for it
        # As rclcpp: in rclpy 7 a transition that the state does not have ends the program.
        try:
            return super()._LifecycleNodeMixin__change_state(transition)
        except RCLError:
            return TransitionCallbackReturn.FAILURE

    def end(self, key):
        sys.stdout.write(f'{key}\n')
        sys.stdout.flush()
        outcome = OUTCOMES.get(key, '')
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
node = Managed(NAME)
# rclpy's ends with an error where another thread destroys what it waits for.
executor = ComposerExecutor()
executor.add_node(node)
with suppress(KeyboardInterrupt, ExternalShutdownException):
    executor.spin()
