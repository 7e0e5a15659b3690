"""Which hosts are asked whether they have a part that they are to have no more."""

import pytest

from composer.errors import UsageError
from composer.hosts.left_hosts import Candidates
from composer.language.specs import HostSpec


def entry(address):
    own = {'address': address, 'user': 'robot', 'port': 22, 'python': 'python3'}
    return {**own, 'identity_file': '', 'folder': '~/f', 'systemd': 'user'}


def facts(*hosts):
    return {'manifest': {'hosts': {each: entry(each) for each in hosts}}}


INVENTORY = {
    name: HostSpec(name=name, description='', path=(), **entry(f'{name}.now'))
    for name in ('front', 'rear', 'spare')
}
# The front has a part, and is to have one.
FACTS = {'front': facts('front', 'rear', 'arm'), 'new': {'manifest': None}}
# Those that are wanted, and to be left as they are: → where the others are, and which of these
# must answer.
CASES = [
    ('', '', ['arm', 'rear.now', 'spare.now'], ['arm', 'rear.now']),
    ('', 'arm', ['rear.now', 'spare.now'], ['rear.now']),
    ('spare', '', ['spare.now'], ['spare.now']),
    ('front', '', [], []),
]


@pytest.mark.parametrize(('wanted', 'leave', 'asked', 'musts'), CASES)
def test_hosts_of_the_inventory_and_of_releases_are_asked(wanted, leave, asked, musts):
    candidates = Candidates(FACTS, INVENTORY, wanted.split())
    hosts = candidates.list_asked(leave.split())
    assert sorted(each.address for each in hosts) == asked
    assert sorted(each.address for each in hosts if each.name in candidates.musts) == musts


def test_only_a_host_without_anything_to_run_is_left_as_it_is():
    with pytest.raises(UsageError, match="'front' is no host without anything to run"):
        Candidates(FACTS, INVENTORY, ()).list_asked(['front'])
