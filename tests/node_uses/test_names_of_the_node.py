"""The tables of names are those of the classes that behaviours meet."""

import inspect

import pytest

from composer.node_uses.node_calls import NODE_METHODS, signature_of
from composer.node_uses.walk import LOGGER_NAMES, NODE_ATTRIBUTES
from composer.runtime.nodes.behaviour_node import Node


def public(owner):
    return {name for name in dir(owner) if not name.startswith('_')}


def parameters(function):
    found = inspect.signature(function).parameters.values()
    return [(each.name, each.default is each.empty) for each in found if each.name != 'self']


def test_the_node_has_these_names():
    assert public(Node) == NODE_METHODS | NODE_ATTRIBUTES


@pytest.mark.ros
def test_its_logger_has_these_names():
    from rclpy.impl.rcutils_logger import RcutilsLogger

    assert public(RcutilsLogger) <= LOGGER_NAMES


@pytest.mark.parametrize('name', sorted(NODE_METHODS))
def test_a_method_of_the_node_is_called_so(name):
    known = signature_of(name).parameters.values()
    found = [(each.name, each.default is each.empty) for each in known]
    assert found == parameters(getattr(Node, name))
