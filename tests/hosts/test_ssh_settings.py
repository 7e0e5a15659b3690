"""Keys and addresses are those that ssh would use."""

import socket
from types import SimpleNamespace

import pytest

pytest.importorskip('asyncssh')

from composer.cli.hosts.deploy import find_addresses
from composer.hosts import connection
from composer.language.pipeline import load_system

CLOSED, OPEN = 0o600, 0o644


@pytest.fixture
def ssh(tmp_path, monkeypatch):
    """Return the folder of ssh in a home of the test's own."""
    monkeypatch.setenv('HOME', str(tmp_path))
    folder = tmp_path / '.ssh'
    folder.mkdir()
    return folder


def host(**options):
    defaults = {'port': None, 'user': '', 'identity_file': ''}
    return SimpleNamespace(name='rear', address='rear', **{**defaults, **options})


# Modes of files; the options and the configuration; the keys that are named to asyncssh, or the
# one that is refused.
CASES = {
    'none': ({}, '', '', None),
    'all closed': ({'id_rsa': CLOSED, 'id_ed25519': 0o400}, '', '', None),
    'public ones': ({'id_rsa': CLOSED, 'id_rsa.pub': OPEN}, '', '', None),
    'one of two is open': ({'id_rsa': OPEN, 'id_ed25519': CLOSED}, '', '', ['id_ed25519']),
    'the only one is open': ({'id_rsa': OPEN}, '', '', 'id_rsa'),
    'open for the group': ({'id_rsa': 0o640}, '', '', 'id_rsa'),
    'the given one is open': ({'mine': OPEN, 'id_rsa': CLOSED}, 'mine', '', 'mine'),
    'the given one is closed': ({'mine': CLOSED, 'id_rsa': OPEN}, 'mine', '', ['mine']),
    'that of the configuration': ({'mine': OPEN, 'id_rsa': CLOSED}, '', 'mine', 'mine'),
    'another one is used': ({'mine': CLOSED, 'id_rsa': OPEN}, '', 'mine', None),
}


@pytest.mark.parametrize('case', CASES)
def test_a_key_that_others_can_read_is_not_used(ssh, case):
    modes, given, configured, expected = CASES[case]
    for name, mode in modes.items():
        (ssh / name).write_text('a key')
        (ssh / name).chmod(mode)
    if configured:
        (ssh / 'config').write_text(f'Host rear\n  IdentityFile {ssh / configured}\n')
    one = host(identity_file=str(ssh / given) if given else '')
    options = {'client_keys': [str(ssh / given)]} if given else {}
    if isinstance(expected, str):
        with pytest.raises(connection.HostConnectionError) as raised:
            connection._without_open_keys(one, options)
        mode = f'{modes[expected]:o}'
        assert str(raised.value) == (
            f"host rear: the key '{ssh / expected}' is not used, as ssh does not: "
            f'others can read it (mode {mode})'
        )
        assert raised.value.help == f"chmod 600 '{ssh / expected}'"
    else:
        found = connection._without_open_keys(one, options)
        keys = None if expected is None else [str(ssh / each) for each in expected]
        assert found.get('client_keys') == keys


@pytest.mark.parametrize(
    ('error', 'reason'),
    [
        (OSError(111, "Connect call failed ('10.0.0.2', 22)"), 'Connection refused'),
        (socket.gaierror(-2, 'Name or service not known'), '[Errno -2] Name or service not known'),
        (OSError('Multiple exceptions: a, b'), 'Multiple exceptions: a, b'),
        (TimeoutError(), 'no answer within 10 s'),
    ],
)
def test_why_a_host_cannot_be_reached_is_said_in_words(error, reason):
    said = str(connection._unreachable(host(), error))
    assert said == f'host rear (rear) cannot be reached: {reason}'


def test_the_address_is_that_of_the_configuration(ssh):
    assert connection.find_real_address(host()) == 'rear'
    (ssh / 'config').write_text('Host re*\n  HostName 10.0.0.2\n  ProxyJump base\n')
    assert connection.find_real_address(host()) == '10.0.0.2'
    (ssh / 'config').write_text('Host re*\n  HostName %h.lan\n')
    assert connection.find_real_address(host()) == 'rear.lan'
    (ssh / 'config').write_text('Host re*\n  Port many\n')
    with pytest.raises(connection.HostConnectionError, match=r'host rear \(rear\): '):
        connection.find_real_address(host())


@pytest.mark.parametrize(
    ('network', 'addresses'),
    [
        ('multicast', {}),
        ('peers', {'front': '10.0.0.2'}),
        ('{discovery: discovery_server, server: front}', {'front': '10.0.0.2'}),
        ('{discovery: discovery_server, server: near}', {}),
    ],
)
def test_hosts_find_each_other_by_what_ssh_has_for_their_names(ssh, capsys, network, addresses):
    (ssh / 'config').write_text('Host f\n  HostName 10.0.0.2\nHost n\n  HostName localhost\n')
    path = ssh / 'robot.yaml'
    path.write_text(
        'version: 1\n'
        f'network: {network}\n'
        'hosts: {front: {address: f}, near: {address: n}, unused: {address: f, user: x}}\n'
        'nodes: {a: {host: front}, b: {host: near}}\n'
    )
    assert find_addresses(load_system(path).spec) == addresses
    told = capsys.readouterr()[1]
    told_of_near = "warning: host near: 'n' is localhost for ssh here (HostName): all hosts must"
    assert (told_of_near in told) == (network != 'multicast' and 'server: front' not in network)
