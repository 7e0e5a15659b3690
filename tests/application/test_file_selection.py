"""Which files a command line means; other people's YAML in a folder is left alone."""

import pytest

from composer.application.file_selection import looks_like_system, select_files

SYSTEM = 'version: 1\nnodes: {}\n'
COMPOSE = 'version: "3"\nservices:\n  db:\n    image: x\nnetworks: {}\nvolumes: {}\n'
WORKFLOW = 'name: ci\non: [push]\njobs:\n  test:\n    runs-on: x\n'
PARAMETERS = 'talker:\n  ros__parameters:\n    rate: 10\n    nodes: [a]\n'


@pytest.fixture
def tree(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(**files):
        for name, text in files.items():
            path = tmp_path / name.replace('__', '/').replace('_yaml', '.yaml')
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)

    return write


def select(*words, **options):
    selection = select_files(words, **options)
    return [str(system.path) for system in selection.systems], [
        (finding.rule, finding.file, finding.message) for finding in selection.findings
    ]


def test_a_named_file_is_taken_as_it_is(tree):
    tree(compose_yaml=COMPOSE)
    assert select('compose.yaml', 'missing.yaml') == (['compose.yaml', 'missing.yaml'], [])


def test_of_a_folder_the_systems_are_taken_all_the_way_down(tree):
    tree(
        a__one_yaml=SYSTEM,
        a__b__two_yaml=SYSTEM,
        a__compose_yaml=COMPOSE,
        a__github_yaml=WORKFLOW,
        a__parameters_yaml=PARAMETERS,
        a__notes=SYSTEM,
    )
    assert select('a') == (['a/one.yaml', 'a/b/two.yaml'], [])


@pytest.mark.parametrize('folder', ['.venv', '.github', 'node_modules', '__pycache__'])
def test_folders_of_tools_are_not_searched(tmp_path, folder):
    (tmp_path / folder).mkdir()
    (tmp_path / folder / 'a.yaml').write_text(SYSTEM)
    (tmp_path / 'b.yml').write_text(SYSTEM)
    assert select(str(tmp_path)) == ([str(tmp_path / 'b.yml')], [])


def test_a_pattern_is_expanded(tree):
    tree(a__one_yaml=SYSTEM, a__b__two_yaml=COMPOSE, three_yaml=SYSTEM)
    assert select('**/*.yaml')[0] == ['a/b/two.yaml', 'a/one.yaml', 'three.yaml']
    assert select('a/*.y*ml')[0] == ['a/one.yaml']


def test_nothing_is_a_finding(tree, tmp_path):
    tree(a__compose_yaml=COMPOSE)
    assert select('a', '*.yml') == (
        [],
        [
            ('nothing-to-check', 'a', 'no system in this folder'),
            ('nothing-to-check', '*.yml', 'no file matches this pattern'),
        ],
    )


def test_standard_input_is_a_dash():
    assert select('-', '-') == (['-'], [])


@pytest.mark.parametrize(
    'text',
    [
        SYSTEM,
        '# yaml-language-server: $schema=../schemas/composer.schema.json\n',
        'nodes: {}\nversion: 7\n',
        'version: 1\nnodess:\n  a:\n    on_start: b:c\n',
        'verson: 1\nnodes:\n  a: {}\n',
        '{version: 1, nodes: {}}',
        'nodes:\n  rover:\n    publishers: {}\n',
        'version: 1\nnodes:\n\tbroken',
        'version: 1\nprocesses:\n  a: {command: [ls]}\n',
        'include:\n  a: {file: a.yaml}\nversion: 1\n',
        '{version: 1, include: {a: {file: a.yaml}}}',
    ],
)
def test_what_is_meant_for_composer_is_known(tmp_path, text):
    path = tmp_path / 'a.yaml'
    path.write_bytes(text.encode())
    assert looks_like_system(path)


@pytest.mark.parametrize(
    'text',
    [
        COMPOSE,
        WORKFLOW,
        PARAMETERS,
        'version: 2\nnodes:\n  # the workers\n  - one\n',
        'version: 1\nnodes: [one]\n',
        'nodes:\n  a: {weight: 3}\n',
        '- version: 1\n  nodes: {}\n',
        '{"version": 1}',
        'version: 1\nnode: {}\n',
        'version: "0.5"\nprocesses:\n  a: {command: ls}\n',
        'version: 1\nprocesses: [a]\n',
        'version: 1\ninclude:\n  - local: a.yml\n',
        'processes: {}\n',
        'version: 1\nhosts: {}\n',
    ],
)
def test_what_others_write_is_left_alone(tmp_path, text):
    path = tmp_path / 'a.yaml'
    path.write_text(text)
    assert not looks_like_system(path)


def test_a_pattern_matches_nothing_that_is_hidden(tree, tmp_path):
    tree(one_yaml=SYSTEM)
    (tmp_path / '.tool').mkdir()
    (tmp_path / '.tool' / 'two.yaml').write_text(SYSTEM)
    assert select('**/*.yaml') == (['one.yaml'], [])
    assert select('.tool/*.yaml') == (['.tool/two.yaml'], [])


def test_a_file_that_another_names_as_its_layer_is_no_system_of_a_folder(tmp_path):
    layer = 'nodes:\n  n:\n    timers: {t: {period: 1, behaviour: "b:f"}}\n'
    for name in ('checked.yaml', 'tested.yaml', 'broken.yaml'):
        (tmp_path / name).write_text(layer)
    (tmp_path / 'a.yaml').write_text(
        'version: 1\nnodes: {}\ncheck: {with_node: {layers: [checked.yaml]}}\n'
    )
    (tmp_path / 'a.scenario.yaml').write_text(
        'version: 1\nsystem: {file: a.yaml, layers: [tested.yaml]}\ncases: {}\n'
    )

    found = select_files([str(tmp_path)])

    assert [each.path.name for each in found.systems] == ['a.yaml', 'broken.yaml']
