"""A shuffle finds the races of `tests/data/races`, and blames none of their twins without a race.

One is looked for here. `COMPOSER_RACE_SEEDS=50` looks for all of them, with so many seeds.
"""

import os
import shlex
from pathlib import Path

import pytest
import yaml

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

pytestmark = pytest.mark.ros

RACES = Path(__file__).parents[2] / 'data' / 'races'
SEEDS = int(os.environ.get('COMPOSER_RACE_SEEDS', '0'))
QUICK = ['async_interleaving']
QUICK_SEEDS = 4


def write(project, kind, race):
    for key, name in (
        ('behaviours', 'racing.py'),
        ('system', 'system.yaml'),
        ('scenario', f'{kind}.scenario.yaml'),
    ):
        twins = race.get(f'twin_{key}', race[key])
        project.write(f'{kind}/{name}', twins if kind == 'twin' else race[key])


@pytest.mark.parametrize('name', sorted(path.stem for path in RACES.iterdir()) if SEEDS else QUICK)
def test_a_shuffle_finds_a_race_and_none_in_its_twin(project, run_json, name):
    race = yaml.safe_load((RACES / f'{name}.yaml').read_text())
    for kind in ('race', 'twin'):
        write(project, kind, race)
    code, report = run_json('race', 'twin', '--shuffle', str(SEEDS or QUICK_SEEDS))
    assert code == 1
    racing, twin = report['cases']
    assert (racing['outcome'], racing['failures']) == ('failed', [])
    assert twin['outcome'] == 'passed'

    code, again = run_json(*shlex.split(racing['run_again'])[2:])
    assert code == 1
    failing = next(each for each in racing['shuffled'] if each['failures'])
    assert again['cases'][0]['shuffled'][0]['failures'] == failing['failures']
