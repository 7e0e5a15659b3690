"""The tables of names are those of the classes that behaviours meet."""

import inspect

import pytest

from composer.inference.evaluation.attributes import NAMES_OF_PART, NODE_ATTRIBUTES, NODE_METHODS
from composer.inference.evaluation.signatures import signature_of
from composer.runtime.nodes.behaviour_node import Node
from composer.runtime.nodes.goals import Goal


def public(owner):
    return {name for name in dir(owner) if not name.startswith('_')}


def parameters(function):
    found = inspect.signature(function).parameters.values()
    return [(each.name, each.default) for each in found if each.name != 'self']


def test_the_node_has_these_names():
    assert public(Node) == NODE_METHODS | NODE_ATTRIBUTES


@pytest.mark.ros
def test_its_parts_have_these_names():
    from rclpy.duration import Duration
    from rclpy.impl.rcutils_logger import RcutilsLogger
    from rclpy.time import Time

    assert public(Goal) - {'begin', 'lose'} == NAMES_OF_PART['goal']
    assert public(Time) <= NAMES_OF_PART['time']
    assert public(Duration) == NAMES_OF_PART['duration']
    assert public(RcutilsLogger) <= NAMES_OF_PART['logger']


@pytest.mark.parametrize('name', sorted(NODE_METHODS - {'with_own_state'}))
def test_a_method_of_the_node_is_called_so(name):
    known = signature_of('node', name).parameters.values()
    assert [(each.name, each.default) for each in known] == parameters(getattr(Node, name))


@pytest.mark.parametrize('name', ['cancel', 'result', 'result_async'])
def test_a_method_of_a_goal_is_called_so(name):
    known = signature_of('goal', name).parameters.values()
    assert [(each.name, each.default) for each in known] == parameters(getattr(Goal, name))
