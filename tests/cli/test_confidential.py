"""Whoever may change a file sees its findings, but no variable and no file of the machine."""

import pytest

from composer.cli.main import run

SECRET = 's3cr3t-Pass'
# What an attacker would try, each with a finding that quotes a value.
LEAKS = {
    'value': 'nodes: {a: {timers: {t: {period: "{{ env(\'PW\') }}", behaviour: m:f}}}}',
    'part': 'nodes: {a: {log_level: "{{ env(\'PW\')[:3] }}"}}',
    'character': 'nodes: {a: {log_level: "{{ env(\'PW\')[1] }}"}}',
    'filter': 'nodes: {a: {log_level: "{{ env(\'PW\') | upper | reverse }}"}}',
    'text': 'nodes: {a: {publishers: {p: "my_{{ env(\'PW\') }}/msg/X"}}}',
    'key': 'nodes: {"{{ env(\'PW\') }}": {}}',
    'namespace': 'nodes: {a: {namespace: "{{ env(\'PW\') }}"}}',
    'topic': 'nodes: {a: {publishers: {p: {type: std_msgs/msg/String, topic: "{{ env(\'PW\') }}"}}}}',
    'foreach': 'nodes: {"n{{ i }}": {foreach: {i: "{{ env(\'PW\') | list }}"}, log_level: "{{ i }}"}}',
    'include': 'include: {i: {file: part.yaml, args: {who: "{{ env(\'PW\') }}"}}}',
    'raised': "nodes: {a: {description: \"{{ {}[env('PW')] }}{{ env('PW').index('zzz') }}\"}}",
}
PART = """
version: 1
args: {who: {type: string}}
nodes: {a: {log_level: "{{ who[2:] }}", timers: {t: {period: "{{ who }}", behaviour: m:f}}}}
"""


@pytest.fixture
def project(tmp_path, monkeypatch):
    project = tmp_path / 'project'
    project.mkdir()
    (project / 'pyproject.toml').touch()
    (project / 'part.yaml').write_text(PART)
    monkeypatch.setenv('PW', SECRET)
    monkeypatch.chdir(project)
    return project


@pytest.mark.parametrize('leak', LEAKS)
@pytest.mark.parametrize('output', ['text', 'json', 'github'])
def test_findings_show_no_value_of_the_environment(project, capsys, leak, output):
    (project / 'a.yaml').write_text(f'version: 1\n{LEAKS[leak]}\n')

    assert run(['check', '--format', output, 'a.yaml']) == 1
    shown = capsys.readouterr().out
    assert 'env("PW")' in shown.replace('\\"', '"')
    words = ('s3cr3t', 'S3CR3T', 'Pass', 'ssaP', 'SSAP', 'cr3t', "'s3c'", "'3'", "'s'")
    assert not [word for word in words if word in shown]


def test_what_is_not_of_the_environment_is_shown(project, capsys):
    (project / 'a.yaml').write_text(
        "version: 1\nnodes: {a: {log_level: \"{{ env('NONE', 'loud') }}\"}}\n"
    )

    assert run(['check', 'a.yaml']) == 1
    assert "got 'loud'" in capsys.readouterr().out


PROCESSES = """
version: 1
processes:
  one: {command: [sh], env: {TOKEN: "{{ env('PW') }}", OWN: literal}}
  two:
    command: [sh]
    env:
      TOKEN: "x{{ env('PW') }}"
      OWN: |
        literal
"""


def test_variables_of_processes_are_in_no_drawing(project, capsys):
    (project / 'a.yaml').write_text(PROCESSES)

    for name in ('json', 'mermaid', 'dot'):
        assert (
            run(['graph', 'a.yaml', '--format', name, '--set', 'processes.two.env.C=literal']) == 0
        )
        shown = capsys.readouterr().out
        assert 'one' in shown
        assert not [word for word in ('literal', SECRET) if word in shown]


NAMES = """
version: 1
nodes:
  "{{ env('PW') | replace('-', '_') }}":
    namespace: "x{{ env('PIN') }}"
    publishers: {p: {type: std_msgs/msg/String, topic: "t_{{ env('PIN') }}", external: true}}
  other: {description: "is {{ env('PW') }}"}
processes: {"p_{{ env('PIN') }}": {command: [sh]}}
"""


def test_names_from_the_environment_are_in_no_drawing(project, monkeypatch, capsys):
    monkeypatch.setenv('PIN', '73519')
    (project / 'a.yaml').write_text(NAMES)

    for name in ('json', 'mermaid', 'dot'):
        assert run(['graph', 'a.yaml', '--format', name]) == 0
        shown = capsys.readouterr().out
        assert 'env(' in shown
        assert not [word for word in ('s3cr3t', '73519') if word in shown]


def test_show_keeps_the_expression_of_a_hidden_variable(project, capsys):
    (project / 'a.yaml').write_text(PROCESSES)

    assert run(['show', 'a.yaml']) == 0
    shown = capsys.readouterr().out
    assert SECRET not in shown
    assert """TOKEN: "{{ env('PW') }}\"""" in shown
    assert '<from env(' in shown


@pytest.mark.parametrize(
    'text', ['root:*:1::\n', 'token: abc\nnodes: 3\n', 'version: 1\nx: abc\n']
)
def test_lines_of_files_outside_the_project_are_not_shown(project, capsys, text):
    (project.parent / 'other.yaml').write_text(text)
    (project / 'a.yaml').write_text('version: 1\ninclude: {i: {file: ../other.yaml}}\n')

    assert run(['check', 'a.yaml']) == 1
    shown = capsys.readouterr().out
    assert 'other.yaml' in shown
    assert 'abc' not in shown
    assert 'root' not in shown.replace(str(project), '')
    (project.parent / 'pyproject.toml').touch()
    (project / 'pyproject.toml').unlink()
    run(['check', 'a.yaml'])
    assert text.splitlines()[0] in capsys.readouterr().out or 'version' in text


def test_a_link_in_the_project_shows_no_lines_either(project, capsys):
    (project.parent / 'other').write_text('root:*:1::\n')
    (project / 'a.yaml').symlink_to('../other')

    assert run(['check', 'a.yaml']) == 1
    assert capsys.readouterr().out == (
        'a.yaml: error[unreadable-file]: this is a link to a file outside of the project that is '
        'not a system\n\n'
    )


def test_a_definition_that_is_a_link_to_something_else_does_not_show_its_words(project, capsys):
    (project.parent / 'other').write_text('root:abc:1::\nTOKEN=abc x\n')
    (project / 'pkg' / 'msg').mkdir(parents=True)
    (project / 'pkg' / 'msg' / 'Point.msg').symlink_to('../../../other')
    (project / 'a.yaml').write_text(
        'version: 1\ninterfaces: {pkg: pkg}\nnodes: {n: {publishers: {p: pkg/msg/Point}}}\n'
    )

    assert run(['check', 'a.yaml']) == 1
    shown = capsys.readouterr().out
    assert (
        'pkg/msg/Point.msg: error[unreadable]: this is a link to a file outside of the project '
        'that is not a definition\n'
    ) in shown
    assert 'abc' not in shown


@pytest.mark.parametrize('options', [(), ('--format', 'json')])
def test_a_plan_shows_no_value_of_the_environment(project, monkeypatch, capsys, options):
    monkeypatch.setenv('PIN', '73519')
    for name, number in (('old.yaml', 1), ('new.yaml', 2)):
        (project / name).write_text(
            f"""\
version: 1
nodes:
  a: {{state: {{k: [{number}, {{deep: "{{{{ env('PW') }}}}", pin: "{{{{ env('PIN') | int }}}}"}}]}}}}
environment: {{TOKEN: "{number}{{{{ env('PW') }}}}"}}
processes: {{p: {{command: [echo, "{number}", "--pin={{{{ env('PIN') }}}}"]}}}}
"""
        )

    assert run(['plan', 'old.yaml', 'new.yaml', *options]) == 0
    shown = capsys.readouterr().out
    assert 'env("PW")' in shown.replace('\\"', '"')
    assert SECRET not in shown
    assert '73519' not in shown
