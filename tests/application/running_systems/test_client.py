"""A command finds what a system has, also if an answer is lost on the way."""

import json
from contextlib import contextmanager

import pytest

pytest.importorskip('rclpy')

from composer.application.ask import down, restart
from composer.application.running_systems.client import Client, EndedError
from composer.application.running_systems.discovery import Discovery
from composer.errors import ComposerError
from composer.runtime.control import protocol
from composer.runtime.control.name_claim import NameClaim
from tests.application.running_systems.test_answer_forms import STATUS_ANSWER

pytestmark = pytest.mark.ros


@contextmanager
def answering_status(peer, name, *, after):
    """Answer each but the first calls of a system's status; yield the list of all calls.

    It has its name on this host, so that it is looked for until it is found.
    """
    from rclpy.callback_groups import ReentrantCallbackGroup
    from rclpy.task import Future
    from std_srvs.srv import Trigger

    calls = []

    async def answer(request, response):
        calls.append(request)
        if len(calls) <= after:
            # As an answer that is lost because its client is not known to the server yet.
            await Future()
        response.message = json.dumps(STATUS_ANSWER | {'name': name})
        return response

    service = f'/{protocol.node_name(name)}/{protocol.STATUS}'
    group = ReentrantCallbackGroup()
    peer.run(peer.node.create_service, Trigger, service, answer, callback_group=group)
    claim = NameClaim(protocol.node_name(name), peer.context.get_domain_id())
    claim.take({'name': name, 'is_asked': True})
    yield calls
    claim.release()


def test_a_status_whose_answer_is_lost_is_asked_for_again(peer):
    with answering_status(peer, 'arm', after=1) as calls, Client() as client:
        assert Discovery(client).find('arm').status['nodes'] == ['/a']
    assert len(calls) >= 2


def test_a_system_that_does_not_answer_may_have_the_node(peer):
    with answering_status(peer, 'arm', after=1000), pytest.raises(ComposerError) as error:
        restart('stuck')
    assert (
        str(error.value)
        == "no system that answers has a node or process 'stuck', and 'arm' does not answer"
    )


def test_a_system_that_ends_before_it_answers_is_down(compose, monkeypatch):
    child = compose('version: 1\nnodes: {only: {}}\n')
    child.wait_until_ready()
    ask = Client.ask

    def ask_in_vain(client, system, *arguments):
        ask(client, system, *arguments)
        raise EndedError(system.name)

    monkeypatch.setattr(Client, 'ask', ask_in_vain)
    assert down() == 'system'
    assert child.wait() == 0
