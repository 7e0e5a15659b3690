"""Cases and events for expectations."""

import pytest

from composer.scenarios.expectations.evaluation import evaluate
from composer.scenarios.parsing.expectation_parser import parse_expectation
from composer.scenarios.parsing.file_parser import parse_step
from composer.scenarios.parsing.full_names import NameReader
from composer.scenarios.specs import CaseSpec, GivenSpec
from composer.scenarios.times import to_nanoseconds
from composer.simulation.events import Event


def at(seconds, kind, name, value=None, node='/n'):
    return Event(to_nanoseconds(seconds), kind, node, name, value)


def step_of(data):
    return parse_step(data, ('cases', 'c', 'when', 0), NameReader({}))


def case_of(*then, until=10, steps=()):
    names = NameReader({})
    expectations = tuple(
        parse_expectation(each, ('cases', 'c', 'then', index), names, lambda text: text)
        for index, each in enumerate(then)
    )
    given = GivenSpec({}, None, {}, {}, ())
    return CaseSpec('c', '', given, steps, expectations, until * 10**9, 0, 60.0, ('cases', 'c'))


@pytest.fixture
def said():
    """Return a function that returns what an expectation says of events: message and diff."""

    def said(then, events, **given):
        failures = evaluate(case_of(then), events, **given)
        return [(each.message, each.diff) for each in failures]

    return said
