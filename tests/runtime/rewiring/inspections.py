"""What the game sees of one process of a system, and does in it; workers are asked to do it."""

import random
from contextlib import ExitStack

from rclpy.parameter import Parameter

from composer.errors import StartError
from composer.runtime.rewiring.node_changes import NodeChange
from composer.runtime.rewiring.rewire import Rewiring
from tests.runtime.rewiring.base_system import WITNESSES
from tests.runtime.rewiring.descriptions import describe
from tests.runtime.rewiring.memories import find_lost, remember

# After steps of these a failure strikes.
_STEPS = (
    (Rewiring, '_begin'),
    (Rewiring, '_end_nodes'),
    (NodeChange, 'change_entity'),
    (NodeChange, 'change_node'),
    (NodeChange, 'replace_record'),
)
FAULT = 'a fault of the game'


def create_parameter_services(system):
    """Create the parameter services that come in the background."""
    system._parameter_services.stop()
    for node in system._nodes.values():
        node.ros.start_parameter_services()


class Inspection:
    """Looks into the part of a system that this process runs."""

    def __init__(self, system):
        self._system = system
        self._kept = {}
        self._patches = ExitStack()

    def describe(self):
        """Return all that the part is."""
        return describe(self._system)

    def create_parameter_services(self):
        """Create the parameter services that come in the background."""
        create_parameter_services(self._system)

    def remember(self):
        """Remember what must stay."""
        self._kept = remember(self._system)

    def find_lost(self, operations):
        """Return what is not as it was though no operation names it."""
        return [repr(each) for each in find_lost(self._kept, remember(self._system), operations)]

    def set_live(self, seed, text):
        """Set a value of the state, and a parameter; return its node, name and value, if any."""
        choice = random.Random(seed).choice
        nodes = [each for name, each in self._system._nodes.items() if name not in WITNESSES]
        if not nodes:
            return None
        node = choice(nodes)
        if state := vars(node.behaviour_node.state):
            setattr(node.behaviour_node.state, choice(sorted(state)), text)
        names = sorted(node.spec.parameters)
        name = choice(names) if names else None
        value = choice([0.5, 3.0, 6, 'fast', 'Dora'])
        if name is None or node.ros._descriptors[name].read_only:
            return None
        (result,) = node.ros.set_parameters([Parameter(name, value=value)])
        # A whole number becomes a float where the parameter is one.
        value = node.ros.get_parameter(name).value
        return (node.full_name, name, repr(value)) if result.successful else None

    def fail_at(self, number):
        """Let a step of the edit fail after it was done; 0 for none."""
        self._patches.close()

        def counting(original):
            def step(*arguments):
                nonlocal number
                result = original(*arguments)
                number -= 1
                if number == 0:
                    raise StartError(FAULT)
                return result

            return step

        for owner, name in _STEPS if number else ():
            original = getattr(owner, name)
            self._patches.callback(setattr, owner, name, original)
            setattr(owner, name, counting(original))


class InspectionElsewhere:
    """Has a worker do what its `Inspection` does."""

    def __init__(self, worker):
        self.worker = worker

    def __getattr__(self, name):
        return lambda *arguments: self.worker.call('inspect', name, *arguments)
