"""The examples of `docs/testing.md` are right, and the first one passes."""

import json
import re
from pathlib import Path

import pytest
import yaml
from jsonschema import Draft202012Validator

import composer
from composer.cli.main import run
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.reports.text import render_finding
from composer.scenarios.checks import check_scenarios
from composer.scenarios.expectations.diffs import render_differences
from composer.scenarios.expectations.matching import Comparison
from composer.scenarios.scenario_files import load_scenarios
from composer.schema import SCENARIO_SCHEMA_NAME, schema_path

ROOT = Path(composer.__file__).parents[1]
PAGE = (ROOT / 'docs' / 'testing.md').read_text()
FIRST, *PARTS = re.findall(r'```yaml\n(.*?)```', PAGE, re.DOTALL)
CASE = json.loads(schema_path(SCENARIO_SCHEMA_NAME).read_text())


@pytest.mark.ros
def test_the_first_example_fits_its_system():
    loaded = load_scenarios(ROOT / 'tests' / 'page.scenario.yaml', text=FIRST.encode())
    assert list(loaded.spec.cases) == ['limits the speed']
    assert [render_finding(each) for each in check_scenarios(loaded, InterfaceCatalogue())] == []


@pytest.mark.ros
def test_the_first_example_passes(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(ROOT)
    path = tmp_path / 'page.scenario.yaml'
    path.write_text(FIRST.replace('../configs', str(ROOT / 'configs')))
    assert run(['test', str(path)]) == 0
    assert 'limits the speed PASSED' in capfd.readouterr().out


@pytest.mark.parametrize('part', PARTS)
def test_the_other_examples_are_parts_of_a_case(part):
    case = {'then': [], **yaml.safe_load(part)}
    schema = {'$ref': '#/$defs/case', '$defs': CASE['$defs']}
    assert [each.message for each in Draft202012Validator(schema).iter_errors(case)] == []


def test_the_diff_is_what_is_shown():
    differences = Comparison(0.001).find_differences(
        {'linear': {'x': 0.3333}}, {'linear': {'x': 0.5}}
    )
    assert f'```\n{render_differences(differences)}\n```' in PAGE


@pytest.mark.ros
def test_the_finding_is_what_is_shown(monkeypatch):
    monkeypatch.chdir(ROOT)
    text = (
        'version: 1\nsystem: {file: ../configs/robot.yaml}\ncases:\n  one:\n    when:\n'
        '      - {at: 1.0, publish: /robot/cmd_vle}\n    then: [{exit_code: 0}]\n    until: 2\n'
    )
    loaded = load_scenarios(Path('tests/robot.scenario.yaml'), text=text.encode())
    (found,) = check_scenarios(loaded, InterfaceCatalogue())
    assert f'```\n{render_finding(found)}\n```' in PAGE
