"""Parameters of processes, before their programs are started with them."""

import pytest

from composer.checks.checker import check_system
from composer.checks.process_parameters import NO_TYPE
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system_text

SYSTEM = """
version: 1
processes:
  driver: {command: ['true'], name: driver, parameters: {%s}}
"""


def findings(parameters):
    system = load_system_text((SYSTEM % parameters).lstrip())
    return [
        (each.rule, each.span.text, each.message)
        for each in check_system(system, InterfaceCatalogue())
    ]


@pytest.mark.parametrize(
    ('parameters', 'finding'),
    [
        (
            'f: [1, a]',
            "parameter 'f': item 1: a list has one type, and this is a string, not an integer",
        ),
        ('f: null', "parameter 'f': there is no value, and ROS has no null"),
        ('f: [[1]]', "parameter 'f': item 0: a list of parameters cannot contain lists"),
        ('f: [{a: 1}]', "parameter 'f': item 0: a list of parameters cannot contain mappings"),
        ('f: 9223372036854775808', "parameter 'f': 9223372036854775808 does not fit in 64 bits"),
        (
            'f: {g: {}}',
            "parameter 'f.g': the mapping is empty, and ROS misreads what follows one",
        ),
        ('f.g: 1, f: {g: 2}', "the parameter 'f.g' is given twice"),
        ('f: {g: []}', f"parameter 'f.g': {NO_TYPE}"),
        ('f: {type: string_array, default: []}', f"parameter 'f': {NO_TYPE}"),
        (
            'f: {type: byte_array, default: [1]}',
            "parameter 'f': a process gets a parameter file, which has no byte type",
        ),
    ],
)
def test_what_ros_refuses_or_misreads_is_a_finding(parameters, finding):
    assert [(rule, message) for rule, _, message in findings(parameters)] == [
        ('bad-parameter', finding)
    ]


def test_a_component_gets_typed_empty_lists_and_bytes():
    system = load_system_text("""
version: 1
containers:
  eyes:
    command: ['true']
    components:
      eye:
        package: p
        plugin: p::Eye
        parameters:
          a: {type: double_array, default: []}
          b: {type: byte_array, default: [1]}
          c: {type: byte_array, default: [256]}
          d: []
""")
    found = check_system(system, InterfaceCatalogue())
    assert [each.message for each in found if each.rule == 'bad-parameter'] == [
        "parameter 'c': item 0: expected a byte (0 to 255), got 256",
        f"parameter 'd': {NO_TYPE}",
    ]


def test_names_in_mappings_are_names_of_parameters():
    assert findings('f: {g h: 1}') == [
        ('bad-name', 'g h', "'f.g h': a parameter name has no spaces")
    ]


@pytest.mark.parametrize(
    'parameters',
    [
        'f: {type: string_array}',
        'f: [1, 2.5, 100000000000000000000]',
        'f: .inf, g: -9223372036854775808, h: [true, false]',
        "f: {g: {h: ''}, i: [a, '1']}, j.k: 1, j: {l: 2}",
    ],
)
def test_what_ros_takes_has_no_finding(parameters):
    assert findings(parameters) == []
