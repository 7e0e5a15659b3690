"""The help for behaviours that are not found."""

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

CODE = """\
from __future__ import annotations
from functools import partial
from typing import TYPE_CHECKING
from rclpy.node import Node
from other import imported

LIMIT = 3

class Thing: ...

def start(node): ...

def _hidden(node): ...
"""


@pytest.fixture
def advise(tmp_path, monkeypatch):
    """Return the help for a behaviour of an own project."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'pyproject.toml').touch()
    (tmp_path / 'other.py').write_text('def imported(node): ...\n')

    def advise(behaviour, **modules):
        for name, text in modules.items():
            path = tmp_path / f'{name.replace("__in__", "/")}.py'
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        path = tmp_path / 'rover.yaml'
        path.write_text(f'version: 1\nnodes: {{rover: {{on_start: "{behaviour}"}}}}\n')
        (finding,) = check_system(load_system(path), InterfaceCatalogue())
        return finding.help

    return advise


@pytest.mark.parametrize(
    ('name', 'code', 'advice'),
    [
        ('zzz', CODE, 'it has: start'),
        ('strt', CODE, "did you mean 'start'?"),
        ('importd', CODE, "did you mean 'imported'?"),
        ('node', 'from rclpy.node import Node', 'it has no functions'),
    ],
)
def test_only_what_can_be_called_is_suggested(advise, name, code, advice):
    assert advise(f'driving:{name}', driving=code) == advice


def test_a_package_that_hides_the_shipped_behaviours_is_named(advise):
    files = {'behaviours__in____init__': '', 'behaviours__in__own': 'def f(node): ...\n'}
    assert advise('behaviours.topics:drop', **files) == (
        'remove behaviours/__init__.py, which hides the other modules of this name'
    )
    assert advise('behaviours.owm:f', **files) == "did you mean 'behaviours.own'?"
