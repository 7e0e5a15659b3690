"""A lifecycle manager that does as that of nav2: its order, its calls, its bonds and most time-outs."""

import threading
from time import monotonic, sleep

import rclpy
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from composer.executor import ComposerExecutor
from tests.runtime.lifecycle.bonds import Bond

GOALS = {
    Transition.TRANSITION_CONFIGURE: State.PRIMARY_STATE_INACTIVE,
    Transition.TRANSITION_CLEANUP: State.PRIMARY_STATE_UNCONFIGURED,
    Transition.TRANSITION_ACTIVATE: State.PRIMARY_STATE_ACTIVE,
    Transition.TRANSITION_DEACTIVATE: State.PRIMARY_STATE_INACTIVE,
    Transition.TRANSITION_UNCONFIGURED_SHUTDOWN: State.PRIMARY_STATE_FINALIZED,
}
SERVICE_TIMEOUT_SEC = 5.0
RESPAWN_SEC = 20.0
# nav2's takes half of the time-out of a bond, here too short for DDS to find a new topic's ends.
BOND_FORMING_SEC = 20.0


class NotAvailableError(Exception):
    """A service is not there, or does not answer."""


class Manager:
    """Brings nodes up in their order, and down in the other one."""

    def __init__(self, names, domain_id, bond_timeout_sec=4.0):
        self.names = names
        self.is_active = False
        self._bond_timeout_sec = bond_timeout_sec
        self._bonds = {}
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=domain_id)
        self.node = Node('lifecycle_manager', context=self._context, use_global_arguments=False)
        self._group = ReentrantCallbackGroup()
        self._clients = {
            (name, kind): self.node.create_client(
                kind, f'{name}/{service}', callback_group=self._group
            )
            for name in names
            for kind, service in ((ChangeState, 'change_state'), (GetState, 'get_state'))
        }
        # rclpy's end with an error where another thread cancels or destroys what they wait for.
        self._executor = ComposerExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def close(self):
        for name in list(self._bonds):
            self._bonds.pop(name).end()
        self._executor.shutdown(1.0)
        self.node.destroy_node()
        self._context.try_shutdown()

    def startup(self):
        self.is_active = self._change_all(Transition.TRANSITION_CONFIGURE) and self._change_all(
            Transition.TRANSITION_ACTIVATE
        )
        return self.is_active

    def pause(self):
        self.is_active = False
        return self._change_all(Transition.TRANSITION_DEACTIVATE)

    def reset(self, *, hard=False):
        self.is_active = False
        down = self._change_all(Transition.TRANSITION_DEACTIVATE, hard=hard)
        return (down or hard) and self._change_all(Transition.TRANSITION_CLEANUP, hard=hard)

    def shutdown(self):
        self.is_active = False
        for transition in (
            Transition.TRANSITION_DEACTIVATE,
            Transition.TRANSITION_CLEANUP,
            Transition.TRANSITION_UNCONFIGURED_SHUTDOWN,
        ):
            self._change_all(transition)

    def find_broken(self):
        """Return the node whose bond is broken; bring all down if there is one."""
        for name, bond in self._bonds.items():
            if bond.is_broken:
                self.reset(hard=True)
                for left in self._bonds.values():
                    left.end()
                self._bonds.clear()
                return name
        return None

    def come_back(self):
        """Wait until all nodes answer again, and bring them up."""
        deadline = monotonic() + RESPAWN_SEC
        while monotonic() < deadline:
            try:
                for name in self.names:
                    self.state(name)
            except NotAvailableError:
                sleep(0.2)
            else:
                return self.startup()
        return False

    def state(self, name):
        return self._call(name, GetState, GetState.Request(), SERVICE_TIMEOUT_SEC).current_state.id

    def _change_all(self, transition, *, hard=False):
        up = transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE)
        for name in self.names if up else reversed(self.names):
            try:
                if not self._change(name, transition) and not hard:
                    return False
            except NotAvailableError:
                # So does nav2's, also for a hard change.
                return False
        return True

    def _change(self, name, transition):
        request = ChangeState.Request(transition=Transition(id=transition))
        if not self._call(name, ChangeState, request, None).success:
            return False
        if self.state(name) != GOALS[transition]:
            return False
        if transition == Transition.TRANSITION_ACTIVATE and self._bond_timeout_sec:
            return self._bind(name)
        if transition == Transition.TRANSITION_DEACTIVATE and name in self._bonds:
            self._bonds.pop(name).end()
        return True

    def _bind(self, name):
        if name not in self._bonds:
            short = name.rpartition('/')[2]
            self._bonds[name] = Bond(self.node, short, self._bond_timeout_sec, self._group)
            deadline = monotonic() + BOND_FORMING_SEC
            while not self._bonds[name].is_formed and monotonic() < deadline:
                sleep(0.01)
            return self._bonds[name].is_formed
        return True

    def _call(self, name, kind, request, timeout_sec):
        client = self._clients[name, kind]
        if not client.wait_for_service(SERVICE_TIMEOUT_SEC):
            raise NotAvailableError(name)
        answered = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _future: answered.set())
        # nav2's waits for a transition without end; a service that went does not answer.
        deadline = monotonic() + (timeout_sec or 60.0)
        while not answered.wait(0.02):
            if monotonic() > deadline or not client.service_is_ready():
                client.remove_pending_request(future)
                raise NotAvailableError(name)
        return future.result()
