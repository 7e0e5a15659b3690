"""The hosts that tests make of network namespaces are as far apart as they are to be."""

import sys

import pytest

from tests.network_namespaces import Network, needs_namespaces
from tests.running import wait_for

ECHO = """
import socket
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
    end.bind(('', 5000))
    while True:
        end.sendto(*end.recvfrom(99))
"""
ASK = """
import socket, sys
answers = 0
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
    end.settimeout(0.2)
    for number in range(int(sys.argv[2])):
        end.sendto(str(number).encode(), (sys.argv[1], 5000))
        try:
            answers += end.recv(99) == str(number).encode()
        except TimeoutError:
            pass
print(answers)
"""

pytestmark = needs_namespaces


@pytest.fixture
def network():
    with Network() as network:
        yield network


def answers(asking, answering, count=1):
    asked = asking.run(sys.executable, '-c', ASK, answering.address, count)
    return int(asked.stdout)


def start_echo(host, asking):
    host.start(sys.executable, '-c', ECHO)
    wait_for(lambda: answers(asking, host), 'an answer')


@pytest.mark.parametrize('how', [('cut', 'mend'), ('take_down', 'bring_up')])
def test_a_host_is_cut_off_and_comes_back(network, how):
    here, there = network.add_host('here'), network.add_host('there')
    start_echo(there, here)
    for name, most in zip(how, (0, 1), strict=True):
        getattr(there, name)()
        wait_for(lambda most=most: answers(here, there) == most, name)


def test_a_bad_cable_loses_some_frames(network):
    here, there = network.add_host('here'), network.add_host('there', loss_percent=30)
    start_echo(there, here)
    assert 0 < answers(here, there, 20) < 20


def test_a_host_without_power_runs_nothing(network):
    here, there = network.add_host('here'), network.add_host('there')
    start_echo(there, here)
    there.kill()
    assert (there.pids(), answers(here, there)) == ([], 0)
