"""The YAML in the docstrings of shipped behaviours."""

import importlib
import inspect
import re
from textwrap import indent

import pytest

from composer.checks import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language import load_system_text

MODULES = ('behaviours.monitor', 'behaviours.topics')
# What stands around an example is left out of it.
AROUND = {'unknown-publisher', 'unused-publisher', 'no-publisher', 'no-subscription'}


def examples():
    for name in MODULES:
        module = importlib.import_module(name)
        functions = inspect.getmembers(module, inspect.isfunction)
        for each in (module, *(function for _, function in functions)):
            if each.__name__.startswith('_') or inspect.getmodule(each) is not module:
                continue
            (example,) = re.findall(r'```yaml\n(.*?)```', inspect.getdoc(each), re.DOTALL)
            yield pytest.param(example, id=f'{name}.{each.__name__}')


@pytest.mark.parametrize('example', examples())
def test_it_is_right_but_for_what_it_leaves_out(example):
    text = example if example.startswith('nodes:') else f'nodes:\n  n:\n{indent(example, "    ")}'
    system = load_system_text(f'version: 1\n{text}')
    findings = check_system(system, InterfaceCatalogue())
    assert {finding.rule for finding in findings} <= AROUND, findings
    assert system.spec.nodes
