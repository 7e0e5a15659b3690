"""`composer check` finds by types what contradicts the declarations of a system, and nothing else."""

import ast
import shutil
from pathlib import Path

import pytest

from composer.checks.checker import check_system, create_context
from composer.cli import main as cli
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.python_source.modules import read_module
from composer.stubs.checking import type_checker
from composer.stubs.checking.annotated_copies import AnnotatedCopy, ReportedPlace
from composer.stubs.checking.kept_types import TypesCheck
from composer.stubs.checking.type_checker import TypeReport
from composer.stubs.project_modules import ProjectModule

DATA = Path(__file__).resolve().parent.parent / 'data'
TYPED = DATA / 'typed'
VALID = sorted((DATA / 'valid' / 'robots').glob('*.yaml'))[::6]

pytestmark = [
    pytest.mark.ros,
    pytest.mark.skipif(type_checker.find_program() is None, reason='pyrefly is not installed'),
]


def find_by_types(path):
    """Return what is found by types, as if no other check had found anything."""
    context = create_context(load_system(path), InterfaceCatalogue())
    return TypesCheck(type_checker.find_program())(context, [])


@pytest.fixture
def typed(tmp_path, monkeypatch):
    """Enter a copy of a system with errors; nothing was kept yet."""
    shutil.copytree(TYPED, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))
    return tmp_path


def test_every_error_is_found_in_its_line_and_no_other_line(typed):
    wanted = {
        (path.name, number)
        for path in typed.glob('*.py')
        for number, line in enumerate(path.read_text().splitlines(), start=1)
        if line.endswith('# error')
    }
    by_types = find_by_types(Path('system.yaml'))
    found = [*by_types, *check_system(load_system(Path('system.yaml')), InterfaceCatalogue())]
    found = [each for each in found if each.span and each.span.source.name.endswith('.py')]
    assert {(each.span.source.name, each.span.line) for each in found} == wanted
    lines = (typed / 'driving.py').read_text().splitlines()
    number, line = next(each for each in enumerate(lines, start=1) if 'LONGEST' in each[1])
    here = ('driving.py', number)
    (finding,) = (each for each in by_types if (each.span.source.name, each.span.line) == here)
    assert finding.span.column == line.index('LONGEST') + 1
    assert finding.message.startswith("sensor_msgs/msg/LaserScan has no field 'LONGEST'")


@pytest.mark.parametrize('file', VALID, ids=lambda file: file.stem)
def test_right_programs_are_not_reported(file, monkeypatch):
    monkeypatch.chdir(file.parent)
    assert [str(each.span) for each in find_by_types(Path(file.name))] == []


def test_what_two_checks_find_is_said_once(typed, capsys):
    (typed / 'scaling.py').write_text(
        'from geometry_msgs.msg import Vector3\n\n\n'
        'def scale(node):\n'
        "    if node.parameters.mode == 'hard':\n"
        "        node.logger.info('hard')\n"
        "    node.publish('status', node.parameters.sped)\n"
        '    return {"angular": Vector3(x=1)}\n'
    )
    text = (typed / 'system.yaml').read_text()
    tick = 'tick: {period: 1.0, behaviour: driving:tick'
    (typed / 'system.yaml').write_text(
        text.replace(tick, tick.replace('driving:tick', 'scaling:scale'))
    )
    assert cli.run(['check', 'system.yaml', '--format', 'github']) == 1
    out = capsys.readouterr().out
    for rule in ('never-equal', 'unknown-parameter', 'field-type'):
        assert sum('scaling.py' in line and rule in line for line in out.splitlines()) == 1, out


def test_a_message_that_is_passed_on_to_another_type_is_found(typed):
    Path('passing.py').write_text('def hear(node, m):\n    return m if m.data else None\n')
    Path('passing.yaml').write_text(
        'version: 1\nnodes:\n  n:\n'
        '    publishers: {out: {type: std_msgs/msg/Int32, external: true}}\n'
        '    subscriptions:\n'
        '      text: {type: std_msgs/msg/String, external: true, behaviour: passing:hear, '
        'publish: out}\n'
    )
    (finding,) = find_by_types(Path('passing.yaml'))
    assert (finding.span.line, finding.rule) == (2, 'field-type')
    assert finding.message.endswith('expected int32, got std_msgs/msg/String')


def test_the_help_names_what_takes_a_message(typed):
    Path('aside.py').write_text(
        'def hear(node, m):\n'
        "    node.publish('pose', m)\n"
        "    node.publish('path', m.header)\n"
        "    node.publish('path', m.pose)\n"
    )
    Path('aside.yaml').write_text(
        'version: 1\nnodes:\n  n:\n'
        '    publishers:\n'
        '      pose: {type: geometry_msgs/msg/PoseStamped, external: true}\n'
        '      path: {type: nav_msgs/msg/Path, external: true}\n'
        '      odometry: {type: nav_msgs/msg/Odometry, external: true}\n'
        '    subscriptions:\n'
        '      in: {type: nav_msgs/msg/Odometry, external: true, behaviour: aside:hear}\n'
    )
    assert [(each.span.line, each.help) for each in find_by_types(Path('aside.yaml'))] == [
        (2, "'odometry' is of this type"),
        (3, 'give it by the name of its field: header'),
        (4, None),
    ]


def test_the_help_writes_the_value_of_the_code(typed):
    Path('small.py').write_text(
        'from geometry_msgs.msg import Point\nfrom std_msgs.msg import String\n\n\n'
        'def tick(node):\n'
        '    a = b = Point()\n'
        '    a.x = b.y = -3\n'
        '    b.z = len(node.name)\n'
        '    String(data=5)\n'
        '    return len(node.name)\n'
    )
    Path('small.yaml').write_text(
        'version: 1\nnodes:\n  n:\n'
        '    publishers: {out: {type: std_msgs/msg/String, external: true}}\n'
        '    timers: {tick: {period: 1.0, behaviour: small:tick, publish: out}}\n'
    )
    found = [(each.span.text, each.help) for each in find_by_types(Path('small.yaml'))]
    assert found == [
        ('-3', 'write it as a float: -3.0'),
        ('len(node.name)', 'write float(…)'),
        ('5', "write '5'"),
        ('len(node.name)', 'write str(…)'),
    ]


def test_pyrefly_checks_a_right_system_again_only_after_a_change(typed, monkeypatch):
    clean = Path('behaviour.py')
    clean.write_text("def tick(node):\n    node.publish('status', 'on')\n")
    Path('small.yaml').write_text(
        'version: 1\nnodes:\n  small:\n'
        '    publishers: {status: {type: std_msgs/msg/String, external: true}}\n'
        '    timers: {tick: {period: 1.0, behaviour: behaviour:tick}}\n'
    )
    runs = []
    run = type_checker.subprocess.run
    monkeypatch.setattr(
        type_checker.subprocess,
        'run',
        lambda *args, **kwargs: runs.append(args) or run(*args, **kwargs),
    )
    for text, rules in (
        (None, []),
        (None, []),
        ("def tick(node):\n    node.publish('status', 1.5)\n", ['field-type']),
    ):
        if text:
            clean.write_text(text)
        before = len(runs)
        assert [each.rule for each in find_by_types(Path('small.yaml'))] == rules
        assert bool(len(runs) - before) == (text is not None or before == 0)


def test_a_line_says_what_was_not_checked_or_by_an_untested_version(typed, monkeypatch, capsys):
    cli.run(['check', 'system.yaml'])
    assert 'pyrefly' not in capsys.readouterr().err
    monkeypatch.setattr('composer.stubs.checking.kept_types.TESTED_VERSION', '0.0.1')
    cli.run(['check', 'system.yaml'])
    assert f'pyrefly {type_checker.TESTED_VERSION} is untested' in capsys.readouterr().err
    broken = typed / 'pyrefly'
    broken.write_text('#!/bin/sh\necho no such symbol >&2\nexit 127\n')
    broken.chmod(0o755)
    monkeypatch.setattr('composer.application.check.find_program', lambda: broken)
    cli.run(['check', 'system.yaml'])
    message = '(pyrefly does not work: no such symbol)'
    assert f'not checked: the types of behaviours {message}' in capsys.readouterr().err
    monkeypatch.setattr('composer.application.check.find_program', lambda: None)
    cli.run(['check', 'system.yaml'])
    assert 'not checked without pyrefly: the types of behaviours' in capsys.readouterr().err


@pytest.mark.parametrize('path', sorted(TYPED.glob('*.py')), ids=lambda path: path.stem)
def test_a_copy_that_reveals_all_types_is_valid(path):
    source = read_module(path)
    copy = AnnotatedCopy(
        ProjectModule(path.stem, source, ast.Module([*source.body], []), ()), (), ()
    )
    report = TypeReport(path.name, 1, 1, 1, 1, 'bad-return', '')
    asked = {}
    for node in ast.walk(copy.module.tree):
        if isinstance(node, ast.stmt):
            line, column = copy.start(node)
            place = ReportedPlace(copy, report._replace(line=line, column=column), {})
            asked.update((id(part), part) for part in place.parts)
    text = copy.revealing(asked.values()).text
    ast.parse(text)
    assert text.count('reveal_type(') == len(asked) > 0
