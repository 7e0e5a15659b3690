"""A plain managed node of rclpy: `managed_program.py NAME [KEY=OUTCOME]…`.

KEY is a callback, as `on_configure`; OUTCOME is `failure`, `error`, `exit` or `hang`. A file
`outcomes/NAME.KEY` in the current folder says so, too, for as long as it is there. With `bond=yes`
it keeps a bond while it is active.
"""

import os
import sys
import threading
from contextlib import suppress
from pathlib import Path

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

from composer.executor import ComposerExecutor

RCLError = rclpy_implementation.RCLError
NAME = sys.argv[1]
OUTCOMES = dict(argument.split('=') for argument in sys.argv[2:] if '=' in argument)


class Managed(LifecycleNode):
    bond = None

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
        with suppress(OSError):
            outcome = Path('outcomes', f'{NAME}.{key}').read_text().strip()
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
        result = self.end('on_activate')
        if result == TransitionCallbackReturn.SUCCESS and 'bond' in OUTCOMES:
            from tests.runtime.lifecycle.bonds import Bond

            self.bond = Bond(self, NAME, float('inf'))
        return result

    def on_deactivate(self, state):
        result = self.end('on_deactivate')
        if result == TransitionCallbackReturn.SUCCESS and self.bond:
            self.bond.end()
            self.bond = None
        return result

    def on_cleanup(self, state):
        return self.end('on_cleanup')


sys.stdout.write(f'pid {os.getpid()}\n')
sys.stdout.flush()
rclpy.init()
node = Managed(NAME)
# See manager.py.
executor = ComposerExecutor()
executor.add_node(node)
with suppress(KeyboardInterrupt, ExternalShutdownException):
    executor.spin()
