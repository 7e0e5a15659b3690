"""Type checkers take just what Composer takes for a message, and so does `composer check`."""

import json
import subprocess
import sys

import pytest

from composer.checks.checker import check_in_context, create_context
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.stubs.checking import type_checker
from composer.stubs.checking.kept_types import TypesCheck
from composer.stubs.system_stubs import stand_ins, stubs_of

pytestmark = pytest.mark.ros

# By name: the section and the type of an end of the node.
ENDS = {
    'text': ('publishers', 'std_msgs/msg/String'),
    'twist': ('publishers', 'geometry_msgs/msg/Twist'),
    'status': ('publishers', 'diagnostic_msgs/msg/DiagnosticArray'),
    'polygon': ('publishers', 'geometry_msgs/msg/Polygon'),
    'clock': ('publishers', 'rosgraph_msgs/msg/Clock'),
    'image': ('publishers', 'sensor_msgs/msg/Image'),
    'joints': ('publishers', 'sensor_msgs/msg/JointState'),
    'empty': ('publishers', 'std_msgs/msg/Empty'),
    'light': ('service_clients', 'std_srvs/srv/SetBool'),
    'count': ('action_clients', 'test_msgs/action/Fibonacci'),
}
HEADER = """\
from array import array
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point32, Vector3
from std_msgs.msg import String
"""
# Payloads that fit an end, and payloads that do not; each is given in every way that there is.
ACCEPTED = {
    'text': ["'x'", "{'data': 'x'}", '{}', "String(data='x')"],
    'twist': [
        "{'linear': {'x': 1}}",
        "{'linear': {'x': np.float64(1)}, 'angular': Vector3(z=1.0)}",
        "{'linear': {'x': node.own_state['x']}}",
    ],
    'status': [
        "{'status': [{'name': 'x', 'values': [{'key': 'k'}, KeyValue()]}]}",
        "{'status': [DiagnosticStatus(), {'level': 0}]}",
        "{'status': ({'level': b'1'},)}",
        "{'status': [{'name': n} for n in 'ab']}",
        "{'header': {'stamp': node.now()}, 'status': []}",
    ],
    'polygon': ["[{'x': 1}]", '[Point32()]', "{'points': [{'y': 2.0}]}", '()'],
    'clock': ['node.now()', 'Time(sec=1)', "{'clock': {'sec': 1}}", "{'clock': node.now()}"],
    'image': [
        "{'data': b'x'}",
        "{'data': np.zeros(3)}",
        "{'data': array('B', [1])}",
        "{'data': [1, 2], 'height': 1, 'is_bigendian': False}",
        "{'data': memoryview(b'x')}",
    ],
    'joints': [
        "{'name': ['a'], 'position': np.arange(3)}",
        "{'name': ('a', 'b'), 'position': range(3)}",
        "{'position': [1, 2.5, np.float32(3)]}",
    ],
    'empty': ['{}', 'None'],
    'light': ['True', "{'data': True}", "{'data': np.bool_(1)}"],
    'count': ['5', "{'order': 5}"],
}
REFUSED = {
    'text': [
        "{'dat': 3}",
        "{'dat': 'x'}",
        "{'data': 3}",
        "{'data': 'x', 'more': 1}",
        "{'dat': node.name}",
        "['x']",
        '3',
    ],
    'twist': ["{'linaer': {'x': 1}}", "{'linear': {'xx': 1}}", "{'linear': {'x': 'fast'}}", "'x'"],
    'status': [
        "{'status': [{'nmae': 'x'}]}",
        "{'status': [DiagnosticStatus(), {'name': 'x', 'lvl': 1}]}",
        "{'status': [{'name': 'x', 'values': [{'key': 'k', 'vlaue': 'v'}]}]}",
        "{'status': {'name': 'x'}}",
        "{'status': 'x'}",
        "{'header': {'stamp': 'now'}}",
    ],
    'polygon': ["[{'xx': 1}]", "{'pionts': []}", "{'points': [{'x': 'y'}]}"],
    'clock': ["{'sec': 1}", "{'clock': {'secs': 1}}", '1'],
    'image': ["{'data': 'x'}", "{'dta': b'x'}", "{'height': 1.5}"],
    'joints': ["{'name': 'a'}", "{'names': ['a']}", "{'name': [1]}", "{'name': {'a': 1}}"],
    'empty': ["{'data': 1}", '1'],
    'light': ["{'dat': True}", "'on'", "{'data': 'on'}"],
    'count': ["{'ordr': 5}", "{'order': 'x'}", "'x'"],
}
SETTINGS = """\
[mypy]
mypy_path = typings
check_untyped_defs = True
ignore_missing_imports = True
"""


def forms_of(name, payload, *, annotated):
    """Yield the head and the body of each function that gives a payload to an end."""
    section, kind = ENDS[name]
    node = "(node: 'Prober')" if annotated else '(node)'
    if section == 'service_clients':
        yield node, f'node.call({name!r}, {payload}).message.upper()'
        yield node, f'node.call({name!r}, timeout=1.0, payload={payload})'
    elif section == 'action_clients':
        yield node, f'node.send_goal({name!r}, {payload}).cancel()'
    else:
        package, _, message = kind.split('/')
        of_type = f'composer_stubs.payloads.{package}.{message}'
        yield node, f'node.publish({name!r}, {payload})'
        yield node, f'node.publish(name={name!r}, payload={payload})'
        yield node + (f" -> '{of_type}'" if annotated else ''), f'return {payload}'
        yielded = f" -> 'Generator[{of_type}, Any, Any]'" if annotated else ''
        yield node + yielded, f'yield {payload}'


def write_probes(folder, *, annotated):
    """Write a system with a function for each way to give each payload; return the wrong lines."""
    lines, wrong, timers, node = HEADER.splitlines(), set(), {}, {}
    if annotated:
        lines += ['from collections.abc import Generator', 'from composer_stubs.system import *']
        packages = sorted({kind.partition('/')[0] for _, kind in ENDS.values()})
        lines += [f'import composer_stubs.payloads.{each}' for each in packages]
    for name, (section, kind) in ENDS.items():
        node.setdefault(section, {})[name] = {'type': kind, 'external': True}
        for payload in (*ACCEPTED[name], *REFUSED[name]):
            for head, body in forms_of(name, payload, annotated=annotated):
                function = f'probe_{len(lines)}'
                lines += [f'def {function}{head}:', f'    {body}']
                timers[function] = {'period': 1.0, 'behaviour': f'probes:{function}'}
                if section == 'publishers':
                    timers[function]['publish'] = name
                if payload in REFUSED[name]:
                    wrong.add(len(lines))
    (folder / 'probes.py').write_text('\n'.join([*lines, '']))
    system = {'version': 1, 'nodes': {'prober': {**node, 'timers': timers}}}
    (folder / 'system.yaml').write_text(json.dumps(system))
    return wrong


def load(folder):
    return create_context(load_system(folder / 'system.yaml'), InterfaceCatalogue())


def show(folder, numbers):
    lines = (folder / 'probes.py').read_text().splitlines()
    return [lines[number - 1].strip() for number in sorted(numbers)]


@pytest.mark.long
def test_check_refuses_what_does_not_fit_and_types_find_nothing_else(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))
    wrong = write_probes(tmp_path, annotated=False)
    context = load(tmp_path)
    found = TypesCheck(type_checker.find_program())(context, [])
    by_types = {each.span.line for each in found}
    assert show(tmp_path, by_types - wrong) == []
    assert len(by_types) > len(wrong) // 2
    by_all = {each.span.line for each in check_in_context(context.system, context)} | by_types
    assert show(tmp_path, by_all & {*wrong}) == show(tmp_path, wrong)


@pytest.mark.long
def test_the_stubs_refuse_what_does_not_fit_and_nothing_else(tmp_path, monkeypatch):
    wrong = write_probes(tmp_path, annotated=True)
    monkeypatch.chdir(tmp_path)
    files = stubs_of(load(tmp_path)) | stand_ins()
    for name, text in files.items():
        (tmp_path / 'typings' / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / 'typings' / name).write_text(text)
    (tmp_path / 'mypy.ini').write_text(SETTINGS)
    command = [sys.executable, '-m', 'mypy', 'probes.py']
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    found = {
        int(line.partition('probes.py:')[2].partition(':')[0])
        for line in result.stdout.splitlines()
        if 'probes.py:' in line and 'error' in line
    }
    assert show(tmp_path, found) == show(tmp_path, wrong), result.stdout
