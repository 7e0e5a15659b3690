"""`composer check` of a system as it is deployed: layers, arguments, `--set`, combinations."""

import json

import pytest

import composer
from composer.cli import main as cli

BASE = """\
version: 1
args: {speed: {type: double, default: 1.0}, robot: {type: string, choices: [cart, truck]}}
nodes:
  "{{ robot }}":
    parameters: {speed: {default: "{{ speed }}", maximum: 5.0}}
  gripper:
    when: "{{ robot == 'truck' }}"
    publishers: {force: std_msgs/msg/Float64}
    timers: {sense: {rate: 1, publish: force, message: {data: 0.0}}}
"""
SITE = 'args: {speed: {type: double, default: 9.0}}\nnodes: {extra: {}}\n'


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """Return exit code, standard output and standard error of a check in an own folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'pyproject.toml').touch()
    (tmp_path / 'base.yaml').write_text(BASE)
    (tmp_path / 'site.yaml').write_text(SITE)
    (tmp_path / 'other.yaml').write_text('version: 1\nnodes: {alone: {}}\n')

    def run(*arguments, **files):
        for name, text in files.items():
            (tmp_path / f'{name}.yaml').write_text(text)
        code = cli.run(['check', *arguments])
        out, err = capsys.readouterr()
        return code, out, err

    return run


def places(out):
    return [line.partition(']: ')[0] for line in out.splitlines() if 'error[' in line]


# Layers, arguments, --set


@pytest.mark.parametrize(
    ('words', 'checked'),
    [
        (['base.yaml', 'other.yaml'], ['base.yaml: 1', 'other.yaml: 1']),
        (['other.yaml', '.'], ['other.yaml: 1', 'base.yaml: 1']),
        (['other.yaml', 'layer.yaml'], ['other.yaml (layer.yaml): 2']),
        (['base.yaml', 'robot:=truck'], ['base.yaml (robot:=truck): 2']),
        (['base.yaml', '2.0', 'truck'], ['base.yaml (2.0 truck): 2']),
        (['base.yaml', 'other.yaml', 'robot:=cart'], ['base.yaml (other.yaml robot:=cart): 2']),
        (['other.yaml', '--set', 'nodes={}'], ['other.yaml (--set nodes={}): 0']),
        (['other.yaml', 'layer.yaml', '--skip-other-files'], ['other.yaml: 1']),
    ],
)
def test_what_is_deployed_is_what_is_checked(run, words, checked):
    code, out, _ = run(*words, '--format', 'json', layer='nodes: {second: {}}\n')
    files = json.loads(out)['files']
    assert code == 0
    assert [
        f'{each["file"]} ({each["given"]}): {each["nodes"]}'.replace(' ()', '') for each in files
    ] == checked


def test_a_layer_is_checked_as_a_part_of_its_system(run):
    code, out, err = run('base.yaml', 'site.yaml')
    assert code == 1
    assert places(out) == ['base.yaml:5:35: error[bad-parameter']
    assert err == '1 error in 1 file\n'


@pytest.mark.parametrize(
    ('text', 'is_layer'),
    [
        ('{nodes: {b: {}}}', True),
        ('include: {b: {file: other.yaml}}', True),
        ('verson: 1\nnodes: {b: {}}', False),  # misspelt, and to be reported as such
        ('talker: {ros__parameters: {}}', False),
        ('', False),
        ('nodes: [', False),
    ],
)
def test_a_layer_has_keys_of_a_system_but_no_version(run, text, is_layer):
    _, out, _ = run('other.yaml', 'layer.yaml', '--format', 'json', layer=text)
    assert ([each['given'] for each in json.loads(out)['files']] == ['layer.yaml']) is is_layer


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (['base.yaml', 'speed:=1.0'], "'robot' is missing"),
        (['base.yaml', 'robot:=car'], "'robot': 'car' is not one of cart, truck"),
        (['other.yaml', '3'], "'3' is one argument too many"),
        (['other.yaml', '--set', 'x'], "--set x: 'x' sets nothing"),
        (['.', 'robot:=cart'], "'.' is a folder, and a system is one file\n  help: it holds\n"),
        (['base.yaml', 'robot:=cart', '--matrix', 'm.yaml'], '--matrix cannot be used together'),
        ([], "missing argument 'FILE'"),
    ],
)
def test_a_command_line_that_does_not_fit_is_wrong_usage(run, words, message):
    code, out, err = run(*words)
    assert (code, out) == (2, '')
    assert err.startswith(f'error: {message}')


# Combinations

MATRIX = """\
cart: {args: {robot: cart}}
fast: {args: {robot: truck, speed: 6.0}}
site: {args: {robot: truck}, layers: [site.yaml]}
set: {args: {robot: truck}, set: {nodes.gripper.log_level: debug}}
"""


def test_each_combination_is_checked_and_named_where_a_finding_holds(run):
    code, out, err = run('base.yaml', '--matrix', 'm.yaml', m=MATRIX)
    assert code == 1
    assert 'base.yaml (cart): ok, 1 node\n' in out
    assert out.count('error[') == 2
    assert '(in fast)\n' in out
    assert '(in site)\n' in out
    assert out.count("nothing in this system subscribes to '/force' (in fast, site, set)\n") == 1
    assert err == '2 errors and 1 warning in 1 file, 4 combinations checked\n'


def test_what_holds_in_all_combinations_is_said_once_and_without_names(run):
    matrix = 'one: {args: {robot: cart}}\ntwo: {args: {robot: cart}}\n'
    text = BASE.replace('nodes:', 'nodes:\n  1st: {}')
    _, out, err = run('wrong.yaml', '--matrix', 'm.yaml', m=matrix, wrong=text)
    assert places(out) == ['wrong.yaml:4:3: error[bad-name']
    assert '(in' not in out
    assert err == '1 error in 1 file, 2 combinations checked\n'


def test_a_file_names_its_own_combinations(run):
    section = ''.join(f'  {line}\n' for line in MATRIX.splitlines())
    code, out, err = run('own.yaml', own=f'{BASE}check:\n{section}')
    assert code == 1
    assert out.count('error[') == 2
    assert err.endswith(', 4 combinations checked\n')
    found = composer.check('own.yaml')
    assert [each.rule for each in found].count('bad-parameter') == 2
    # An argument, or another file of combinations, takes their place.
    assert run('own.yaml', 'robot:=cart')[:2] == (0, 'own.yaml (robot:=cart): ok, 1 node\n')
    code, out, _ = run('own.yaml', '--matrix', 'm.yaml', m='one: {args: {robot: cart}}\n')
    assert (code, out) == (0, 'own.yaml (one): ok, 1 node\n')


def test_a_comment_that_silences_something_in_one_combination_is_used(run):
    text = BASE.replace('Float64}', 'Float64}  # composer: ignore[no-subscription]')
    section = 'check: {cart: {args: {robot: cart}}, truck: {args: {robot: truck}}}\n'
    assert run('own.yaml', own=text + section)[0::2] == (0, '2 combinations checked\n')


@pytest.mark.parametrize(
    ('combination', 'finding'),
    [
        ('{args: {robt: cart}}', "1:12: error[unknown-argument]: there is no argument 'robt'"),
        ('{args: {robot: car}}', "1:19: error[argument-type]: 'robot': 'car' is not one of"),
        ('{}', "1:1: error[missing-argument]: 'a' does not give the argument 'robot'"),
        ('{arg: {robot: cart}}', "1:5: error[unknown-key]: unknown key 'arg'"),
        ('{layers: [sit.yaml]}', "1:14: error[bad-combination]: there is no file 'sit.yaml'"),
        ('{layers: [/etc/passwd]}', "1:14: error[bad-combination]: '/etc/passwd' lies outside of"),
        ('{set: {nodes.x.y: 1}}', "1:11: error[bad-combination]: there is no 'x' in nodes"),
    ],
)
def test_an_error_in_a_matrix_has_its_place(run, combination, finding):
    code, out, _ = run('base.yaml', '--matrix', 'm.yaml', m=f'a: {combination}\n')
    assert code == 1
    assert f'm.yaml:{finding}' in out


def test_of_too_many_combinations_the_first_are_checked(run):
    text = ''.join(f'c{number}: {{args: {{robot: cart}}}}\n' for number in range(120))
    code, out, err = run('base.yaml', '--matrix', 'm.yaml', m=text)
    assert code == 1
    assert out.startswith(
        'm.yaml:101:1: error[too-many-entries]: only the first 100 combinations are checked\n'
    )
    assert err == '1 error in 1 file, 100 combinations checked\n'


@pytest.mark.parametrize('text', ['', 'a: ['])
def test_a_matrix_that_cannot_be_read_is_a_finding(run, text):
    code, out, _ = run('base.yaml', '--matrix', 'm.yaml', m=text)
    assert code == 1
    assert out.startswith('m.yaml')
    assert 'version' not in out


def test_the_schema_of_matrix_files_knows_them(capsys):
    from jsonschema import Draft202012Validator

    assert cli.run(['schema', '--matrix']) == 0
    schema = json.loads(capsys.readouterr().out)
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    assert validator.is_valid(
        {'fast': {'args': {'speed': 6.0}, 'layers': ['a.yaml']}, 'plain': {}}
    )
    assert not validator.is_valid({'fast': {'arg': {}}})


def test_reports_name_the_combination_of_a_file(run):
    _, out, _ = run('base.yaml', '--matrix', 'm.yaml', '--format', 'json', m=MATRIX)
    assert [file['combination'] for file in json.loads(out)['files']] == [
        *('cart', 'fast', 'site', 'set')
    ]
    _, out, _ = run('base.yaml', '--matrix', 'm.yaml', '--format', 'junit', m=MATRIX)
    assert 'name="base.yaml (fast)" file="base.yaml"' in out
