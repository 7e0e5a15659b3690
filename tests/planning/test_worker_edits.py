"""What an edit of workers does, and of the nodes in them."""

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from composer.cli.main import run as run_command

SCHEMA = json.loads((Path(__file__).parents[2] / 'schemas' / 'plan.schema.json').read_text())
SYSTEM = """\
version: 1
workers:
  vision: {cpus: [0], nice: 5, environment: {OMP: 1}}
nodes:
  camera: {worker: vision}
  detector: {worker: vision, state: {count: 0}}
  planner: {}
"""
LOST = 'lost: its state, parameters set while it ran, all that is queued'
EDITS = {
    'a node moves to a worker that is there': (
        'planner: {}',
        'planner: {worker: vision}',
        [f"± node 'planner': worker \"\" → vision (old:7 → new:7); a node runs in one process; {LOST}"],
    ),
    'a node moves to one that is not': (
        'camera: {worker: vision}',
        'camera: {worker: eyes}',
        [
            "+ worker 'eyes' (new:5)",
            f"± node 'camera': worker vision → eyes (old:5 → new:5); a node runs in one process; {LOST}",
        ],
    ),
    'all nodes of one leave': (
        'workers:\n  vision: {cpus: [0], nice: 5, environment: {OMP: 1}}\nnodes:\n'
        '  camera: {worker: vision}\n  detector: {worker: vision, state: {count: 0}}',
        'nodes:\n  camera: {}',
        [
            "- worker 'vision' (old:3); lost: the running process",
            f"± node 'camera': worker vision → \"\" (old:5 → new:3); a node runs in one process; {LOST}",
            f"- node 'detector' (old:6); {LOST}",
        ],
    ),
    'what a process can change while it runs': (
        'cpus: [0], nice: 5',
        'cpus: [1, 2], nice: 7, threads: 3, log_level: debug, required: true, '
        'restart: {when: always, delay: 2, max: 3}',
        [
            "~ worker 'vision': cpus [0] → [1, 2] (old:3 → new:3), nice 5 → 7 (old:3 → new:3), "
            'threads = 3 (new:3), restart on_failure → always (old:3 → new:3), '
            'restart.delay 1.0 → 2.0 (old:3 → new:3), restart.max = 3 (new:3), '
            'required false → true (old:3 → new:3), log_level = debug (new:3)'
        ],
    ),
    'a variable, and a node of the same worker': (
        'OMP: 1}}\nnodes:\n  camera: {worker: vision}\n  detector: {worker: vision, state: {count: 0}}',
        'OMP: 2}}\nnodes:\n  camera: {worker: vision}\n  detector: {worker: vision, state: {count: 0, x: 1}}',
        [
            "± worker 'vision': environment.OMP \"1\" → \"2\" (old:3 → new:3); "
            'a process takes this when it starts; lost: the running process',
            f"± node 'camera' (new:5); its worker starts anew; {LOST}",
            f"± node 'detector': state.x = 1 (new:6); its worker starts anew; {LOST}",
        ],
    ),
    'a network': (
        'version: 1',
        'version: 1\nnetwork: peers',
        [
            "± system 'system': network.discovery = peers (new:2), network.port = 11811 (new:2); "
            'the middleware reads this when it starts; lost: all that is not in the files; '
            'this needs a restart: composer down, then composer up'
        ],
    ),
}  # fmt: skip


@pytest.fixture
def plan(tmp_path, monkeypatch, capsys):
    """Run `composer plan` on a system and an edit of it."""
    monkeypatch.chdir(tmp_path)

    def plan(old, new, *options):
        assert old in SYSTEM
        for folder, text in (('old', SYSTEM), ('new', SYSTEM.replace(old, new))):
            Path(folder).mkdir()
            Path(folder, 'system.yaml').write_text(text)
        code = run_command(['plan', 'old/system.yaml', 'new/system.yaml', *options])
        out, err = capsys.readouterr()
        assert code == 0, err
        return out.replace('/system.yaml', '')

    return plan


@pytest.mark.parametrize('name', EDITS)
def test_an_edit_of_a_worker_is_told(plan, name):
    old, new, told = EDITS[name]
    assert plan(old, new).splitlines()[:-1] == told


@pytest.mark.parametrize('name', EDITS)
def test_the_document_is_as_its_schema_says(plan, name):
    old, new, told = EDITS[name]
    document = json.loads(plan(old, new, '--format', 'json'))
    Draft202012Validator(SCHEMA).validate(document)
    assert len(document['operations']) == len(told)
    kinds = {each['kind']: each['node'] for each in document['operations']}
    assert kinds.get('worker') is None
