"""`no`, `on` and the like: bools in ROS's parameter files, and texts in the files of Composer."""

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.ros_parameters.rcl_values import read_plain_scalar
from composer.yaml_text.scalars import BOOLS_OF_YAML_1_1, parse_plain_scalar

SYSTEM = """\
version: 1
args: {%s}
include: {part: {file: part.yaml, args: {%s}}}
nodes:
  n:
    parameters: {%s}
    on_start: parts:begin
processes:
  p: {command: ['true'], name: p, parameters: {%s}}
containers:
  c: {components: {d: {package: parts, plugin: 'parts::D', parameters: {%s}}}}
"""
CODE = """\
def begin(node):
    print(list(node.parameters))
"""
SECTIONS = ('argument', 'include', 'node', 'process', 'component')
TEXT, FALSE = 'text-for-bool', 'write false'
EITHER = "write false, or 'no' in quotes for the text"


@pytest.fixture
def find(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'parts.py').write_text(CODE)
    part = 'version: 1\nargs: {flag: false, word: "on"}\nnodes: {m: {on_start: parts:begin}}\n'
    (tmp_path / 'part.yaml').write_text(part)

    def run(section, entry, *settings):
        given = [entry if each == section else '' for each in SECTIONS]
        path = tmp_path / 'system.yaml'
        path.write_text(SYSTEM % tuple(given))
        found = check_system(load_system(path, set_values=settings), InterfaceCatalogue())
        ours = [each for each in found if 'write ' in (each.help or '')]
        return [(each.rule, each.span.text, each.help) for each in ours]

    return run


@pytest.mark.parametrize('section', ['argument', 'node', 'process', 'component'])
def test_a_word_without_quotes_is_found_and_a_text_is_not(find, section):
    assert find(section, 'x: no') == [(TEXT, 'no', EITHER)]
    for text in ("'no'", '"no"', '!!str no', 'none', 'false', "'{{ 1 }}no'"):
        assert find(section, f'x: {text}') == [], text


@pytest.mark.parametrize(
    ('section', 'entry', 'found'),
    [
        ('argument', 'x: {default: no}', [(TEXT, 'no', EITHER)]),
        ('argument', 'x: {default: on, choices: [on, off]}', []),
        ('argument', 'x: {default: no, type: bool}', [('bad-argument-declaration', 'no', FALSE)]),
        ('include', 'flag: no', [('argument-type', 'no', FALSE)]),
        ('node', 'x: {default: no}', [(TEXT, 'no', EITHER)]),
        ('node', 'x: {default: no, type: string}', []),
        ('node', 'x: {default: no, type: bool}', [('bad-parameter', 'no', FALSE)]),
        ('node', 'x: [no, no]', [(TEXT, 'no', EITHER)] * 2),
        ('node', 'axes: [x, y, z]', []),
        ('process', 'x: {y: {z: no}}', [(TEXT, 'no', EITHER)]),
    ],
)
def test_what_is_declared_a_text_is_one(find, section, entry, found):
    assert find(section, entry) == found


def test_the_words_are_those_that_ros_reads_as_bools():
    for word in ('y', 'n', 'yes', 'no', 'on', 'off', 'true', 'false', 'oN', 'nO'):
        for spelling in (word, word.title(), word.upper()):
            value = read_plain_scalar(spelling)
            assert BOOLS_OF_YAML_1_1.get(spelling, parse_plain_scalar(spelling)) == value
