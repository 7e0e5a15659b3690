"""Inventories by which no host can be reached are found, and those that work are left alone."""

import re

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.network.addresses import is_address

NODES = 'nodes: {a: {host: h}}'
NAME = "expected the IP address or name of a computer; got '{}'"
PATH = 'expected a {}: a path of letters, digits and _ . + - /; got {!r}'
# An address, and what helps.
WRONG = {
    'robot@10.0.0.1': "the user has a key of its own, 'user:'",
    '10.0.0.2:2222': "the port has a key of its own, 'port:'",
    '[2001:db8::2]': "write it without brackets; its port goes into 'port:'",
    '10.0.0.2/24': 'leave out the slash and what comes after it',
    '-oProxyCommand=x': 'programs would take it for an option',
    '999.1.1.1': 'a name has letters, digits, dashes, underscores and dots',
    'a b': 'a name has letters, digits, dashes, underscores and dots',
    '$(x)': 'a name has letters, digits, dashes, underscores and dots',
}
RIGHT = ['10.0.0.1', 'fe80::1', 'fe80::1%eth0', '::1', 'robot-1.local', 'jet_son', 'pi.2', 'x.']


@pytest.fixture(scope='module')
def find(tmp_path_factory):
    path = tmp_path_factory.mktemp('inventory') / 'robot.yaml'

    def find(text):
        path.write_text(f'version: 1\n{NODES}\n{text}\n')
        found = check_system(load_system(path), InterfaceCatalogue())
        return [(each.rule, each.message, each.help) for each in found]

    return find


@pytest.mark.parametrize(('address', 'advice'), WRONG.items())
def test_what_is_no_address_is_found(find, address, advice):
    (found,) = find(f'hosts: {{h: {{address: "{address}"}}}}')
    assert found == ('bad-value', NAME.format(address), advice)
    ((rule, message, _),) = find(f'hosts: {{h: {{}}}}\nnetwork: {{peers: ["{address}"]}}')
    assert (rule, message) == ('bad-value', NAME.format(address))


def test_what_can_be_an_address_is_left_alone(find):
    for address in RIGHT:
        assert (
            find(f'hosts: {{h: {{address: "{address}"}}}}\nnetwork: {{peers: ["{address}"]}}')
            == []
        )


@given(text=st.text(max_size=20))
def test_no_address_means_anything_to_a_shell_or_a_program(text):
    assert not is_address(text) or re.fullmatch(r'[\w.:][\w.:%-]*', text)


@pytest.mark.parametrize('key', ['python', 'folder'])
@pytest.mark.parametrize(
    ('value', 'is_right'),
    [
        *((each, True) for each in ('python3', '/opt/py/bin/python3.12', '~/.venv/bin/python')),
        *((each, True) for each in ('.local/x', "{{ 'a' }}")),
        *((each, False) for each in ('python3; rm x', '-c', '$(x)', 'a b', '~user/x', 'a`b`')),
        ("{{ 'a b' }}", False),
    ],
)
def test_a_path_is_one_word_for_a_shell(find, key, value, is_right):
    found = find(yaml.safe_dump({'hosts': {'h': {key: value}}}))
    assert [each[0] for each in found] == ['bad-value'] * (not is_right)


@pytest.mark.parametrize(
    ('text', 'rules'),
    [
        ('hosts: {h: {address: localhost}, g: {address: 127.0.1.1}}', ['duplicate-host']),
        (
            'hosts: {h: {address: "2001:db8::1"}, g: {address: "2001:DB8:0::1"}}',
            ['duplicate-host'],
        ),
        ('hosts: {h: {systemd: system}}', ['needs-root']),
        ('hosts: {h: {systemd: system, user: robot}}', ['needs-root']),
        ('hosts: {h: {user: "root;id"}}', ['bad-value']),
        ('hosts: {h: {user: "j.doe@example.org"}}', []),
        ('hosts: {h: {systemd: system, user: root}}', []),
        ('hosts: {h: {}}\nnetwork: {port: 3}', ['ignored-network-key']),
        (
            'hosts: {h: {}}\nnetwork: {server: h, discovery: zenoh, peers: [x], port: 3}',
            ['ignored-network-key'],
        ),
        ('hosts: {h: {}}\nnetwork: {peers: [x]}', []),
    ],
)
def test_what_cannot_be_meant_is_found(find, text, rules):
    assert [rule for rule, *_ in find(text) if rule != 'missing-middleware'] == rules
