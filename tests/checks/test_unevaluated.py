"""Texts that launch files and shells evaluate, and a system file does not."""

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system_text

COMMAND = 'processes: {p: {command: [%s]}}'
HOME = "write {{ env('HOME') }}"
SHELL = "write command: [sh, -c, '…'], with the whole command line"


def find(text):
    """Return `column text: help` of each finding of the rule."""
    system = load_system_text(f'version: 1\n{text}\n')
    return [
        (each.span.text, each.help)
        for each in check_system(system, InterfaceCatalogue())
        if each.rule == 'unevaluated-expression'
    ]


@pytest.mark.parametrize(
    ('text', 'found', 'advice'),
    [
        (COMMAND % 'echo, $(env HOME)/x', '$(env HOME)', HOME),
        ('args: {a: "x/$(var b)"}', '$(var b)', 'write {{ b }}'),
        ('nodes: {n: {remap: {a: $(var b)/c}}}', '$(var b)', 'write {{ b }}'),
        (COMMAND % 'echo, $HOME/x', '$HOME', HOME),
        (COMMAND % 'echo, bag_$USER', '$USER', "write {{ env('USER') }}"),
        (COMMAND % 'echo, ~/x', '~', HOME),
        ('environment: {PATH: /a:$PATH}', '$PATH', "write {{ env('PATH') }}"),
        ('processes: {p: {command: [echo], env: {A: $HOME}}}', '$HOME', HOME),
        *((COMMAND % f"echo, '{sign}', b", sign, SHELL) for sign in ('|', '&&', '>>', '2>&1')),
    ],
)
def test_what_a_launch_file_or_a_shell_evaluates_is_an_error(text, found, advice):
    ((at, told),) = find(text)
    assert (at, told) == (found, advice or told)


@pytest.mark.parametrize(
    'text',
    [
        COMMAND % "sh, -c, 'echo $(env HOME) $HOME | cat > ~/x'",
        COMMAND % "ssh, host, ls, '|', cat, ~/x, $HOME/x",
        COMMAND % "echo, 'a$b', 'pa$$W', 'a | b', '{{ 1 | string }}', '$(pwd)'",
        COMMAND % 'echo, --ros-args, -r, ~/a:=~/b, -r, ~/c',
        COMMAND % "expr, 1, '>', 2",
        'processes: {p: {launch: a.launch.py, arguments: {db: ~/x.db}}}',
        'processes: {p: {command: [echo], parameters: {a: ~/x, env: {B: $HOME}}}}',
        'environment: {A: "[${severity}] $x"}',
        'args: {a: {default: 1, description: As $(var a) in launch files.}}',
    ],
)
def test_what_may_be_meant_as_it_stands_is_left_alone(text):
    assert find(text) == []
