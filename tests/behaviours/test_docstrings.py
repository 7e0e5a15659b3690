"""The YAML in the docstrings of shipped behaviours."""

import importlib
import inspect
import re
from textwrap import indent

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system_text

MODULES = ('behaviours.monitor', 'behaviours.topics')
# What stands around an example is left out of it.
AROUND = {'unknown-publisher', 'unused-publisher', 'no-publisher', 'no-subscription'}


def examples():
    for name in MODULES:
        module = importlib.import_module(name)
        functions = [
            function
            for key, function in inspect.getmembers(module, inspect.isfunction)
            if not key.startswith('_') and inspect.getmodule(function) is module
        ]
        for each in (module, *functions):
            found = re.findall(r'```yaml\n(.*?)```', inspect.getdoc(each), re.DOTALL)
            assert found or each is module, f'{name}.{each.__name__} shows no use'
            yield from (pytest.param(one, id=f'{name}.{each.__name__}') for one in found)


@pytest.mark.parametrize('example', list(examples()))
def test_it_is_right_but_for_what_it_leaves_out(example):
    text = example if example.startswith('nodes:') else f'nodes:\n  n:\n{indent(example, "    ")}'
    system = load_system_text(f'version: 1\n{text}')
    findings = check_system(system, InterfaceCatalogue())
    assert {finding.rule for finding in findings} <= AROUND, findings
    assert system.spec.nodes
