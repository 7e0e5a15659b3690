"""Findings as text: the excerpt shows the place whatever the line looks like."""

import pytest

from composer.cli.main import run
from composer.diagnostics import Diagnostic, SourceFile, Span, diagnostic_at
from composer.reports.text import render_finding


def excerpt(line, column, length=1):
    """Return the line as it is shown and the line with the carets, without their margins."""
    span = Span(SourceFile('a.yaml', (line,)), 1, column, length)
    _, shown, carets = render_finding(diagnostic_at(span, 'bad-name', 'message')).splitlines()
    return shown.removeprefix('  1 | '), carets.removeprefix('    | ')


def test_a_finding_without_a_place_names_the_file():
    assert render_finding(Diagnostic('bad-name', 'message', 'a.yaml', help='do so')) == (
        'a.yaml: error[bad-name]: message\n  help: do so'
    )


def test_an_empty_line_is_not_shown():
    span = Span(SourceFile('a.yaml', ('', '   ')), 2, 1)
    assert render_finding(diagnostic_at(span, 'bad-name', 'message')) == (
        'a.yaml:2:1: error[bad-name]: message'
    )


@pytest.mark.parametrize(
    ('line', 'column', 'length', 'shown', 'carets'),
    [
        ('key: value', 6, 5, 'key: value', '     ^^^^^'),
        ('key: ', 6, 0, 'key: ', '     ^'),
        ('a:\tb', 4, 1, 'a: b', '   ^'),
        ('日本: é', 5, 1, '日本: é', '      ^'),
        ('a: 日本', 4, 2, 'a: 日本', '   ^^^^'),
        ('e\u0301: x', 5, 1, 'e\u0301: x', '   ^'),
        ('a: \u202ex', 4, 2, 'a: \ufffdx', '   ^^'),
    ],
)
def test_the_carets_mark_the_place(line, column, length, shown, carets):
    assert excerpt(line, column, length) == (shown, carets)


@pytest.mark.parametrize('column', [1, 80, 81, 161, 162, 500, 999, 1000])
def test_of_a_long_line_the_part_around_the_finding_is_shown(column):
    line = 'x' * (column - 1) + '!' + 'x' * (1000 - column)
    shown, carets = excerpt(line, column)
    assert len(shown) == 160
    assert shown[carets.index('^')] == '!'


def test_what_a_terminal_would_obey_is_escaped():
    span = Span(SourceFile('a.yaml', ('a',)), 1, 1)
    finding = diagnostic_at(span, 'bad-name', 'one\n\x1b[31mtwo', help="write '\x07'")
    lines = render_finding(finding).splitlines()
    assert lines[0] == r'a.yaml:1:1: error[bad-name]: one\n\x1b[31mtwo'
    assert lines[-1] == r"  help: write '\x07'"


@pytest.mark.parametrize(
    ('system', 'counted'),
    [
        ('nodes: {}', '0 nodes'),
        ('processes: {a: {command: [sh]}}', '1 external process'),
        ('processes: {a: {command: [sh]}, b: {command: [sh]}}', '2 external processes'),
        ('nodes: {n: {}}\nprocesses: {a: {command: [sh]}}', '1 node'),
    ],
)
def test_a_system_of_external_processes_alone_counts_these(tmp_path, capsys, system, counted):
    (tmp_path / 'a.yaml').write_text(f'version: 1\n{system}\n')

    assert run(['check', str(tmp_path / 'a.yaml')]) == 0
    assert capsys.readouterr().out.endswith(f'a.yaml: ok, {counted}\n')
