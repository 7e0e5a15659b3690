import json
import shlex
import subprocess
import sys

import pytest

from composer.errors import ComposerError
from composer.export.systemd import render_unit, unit_name

# All that systemd, or its quoting, would take for something else.
ODD = [
    'a b',
    '100%',
    '%h',
    '%%n',
    '$HOME',
    '${HOME}',
    '$$',
    '"quoted"',
    "'quoted'",
    'back\\slash',
    'end\\',
    '\\x20',
    'line\nbreak',
    '\ttab',
    'ünïcödé 机器人',
    '# no comment',
    ';',
    '-',
    '@y',
    '!',
    'NAME:=value',
    '',
    *(f'a{chr(code)}b' for code in range(1, 128)),
]
DUMP = """\
#!{python}
import json, os, pathlib, sys
pathlib.Path({out!r}).write_text(json.dumps([sys.argv, os.getcwd(), dict(os.environ)]))
"""


def render(command=('/usr/bin/true',), **given):
    return render_unit(
        command,
        **{'description': 'a system', 'folder': '/', 'stop_sec': 15.0, 'scope': 'user', **given},
    )


@pytest.mark.parametrize('scope', ['user', 'system'])
def test_a_unit_with_odd_words_passes_the_check_of_systemd(tmp_path, verify_unit, scope):
    folder = tmp_path / 'a b%h $HOME "x" \\ ü'
    folder.mkdir()
    text = render(
        ['/usr/bin/env', *ODD],
        folder=str(folder),
        scope=scope,
        description='100 % \\',
        environment={f'ODD_{count}': each for count, each in enumerate(ODD)},
        environment_file='%E/composer/robot.env',
        user='root',
        reload=['/usr/bin/true', *ODD],
        lowest_nice=-5,
        comments=['Written \\', 'for $HOME'],
    )
    assert verify_unit('composer-odd.service', text, scope) == (0, '')


def test_the_check_of_systemd_finds_what_is_wrong(verify_unit):
    code, told = verify_unit('wrong.service', render().replace('/usr/bin/true', 'nowhere'), 'user')
    assert (code, 'nowhere' in told) == (1, True)


def test_systemd_gives_a_program_the_words_that_were_meant(tmp_path, service_manager):
    folder, out = tmp_path / 'a b%h $HOME "x" ü ', tmp_path / 'out.json'
    folder.mkdir()
    program = tmp_path / 'a program $HOME %h'
    program.write_text(DUMP.format(python=sys.executable, out=str(out)))
    program.chmod(0o755)
    variables = {f'ODD_{count}': each for count, each in enumerate(ODD)}
    text = render([str(program), *ODD], folder=str(folder), environment=variables)
    script = (
        f'systemctl --user start dump; until test -s {shlex.quote(str(out))}; do sleep 0.05; done'
    )
    service_manager({'dump.service': text.replace('Type=notify', 'Type=oneshot')}, script)
    words, cwd, environment = json.loads(out.read_text())
    assert words == [str(program), *ODD]
    assert cwd == str(folder)
    assert {name: environment.get(name) for name in variables} == variables


@pytest.mark.parametrize('name', ['robot', 'my robot', '100%', 'ünï', 'a\\b', 'x@y', '$a:b_c.d'])
def test_a_unit_is_named_as_systemd_escapes_it(name):
    # It takes a dash for a slash of a path, which names of units have as it is.
    escaped = subprocess.run(
        ['systemd-escape', '--', name], check=True, capture_output=True, text=True
    )
    assert unit_name(name) == f'composer-{escaped.stdout.strip()}.service'


def test_parts_of_hosts_have_units_of_their_own():
    assert unit_name('robot', 'jetson') == 'composer-robot@jetson.service'
    assert unit_name('robot@jetson') != unit_name('robot', 'jetson')
    assert unit_name('the-robot') == 'composer-the-robot.service'


@pytest.mark.parametrize('folder', ['relative', '/line\nbreak'])
def test_a_folder_that_no_unit_can_have_is_refused(folder):
    with pytest.raises(ComposerError, match='systemd cannot be given'):
        render(folder=folder)


@pytest.mark.parametrize('program', ['true', '/a"b', "/a'b", '/a\\b', '/a\nb'])
def test_a_program_that_no_unit_can_run_is_refused(program):
    with pytest.raises(ComposerError, match='systemd cannot run'):
        render([program])


def test_a_unit_of_a_user_knows_no_target_of_the_system():
    assert 'network-online' not in render()
    assert 'User=' not in render(user='robot')
    assert 'After=network-online.target' in render(scope='system')
    assert 'User=robot' in render(scope='system', user='robot')
    assert 'User=root' in render(scope='system')
