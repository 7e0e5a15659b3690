"""What a host answers may be anything: then it is lost, and that is said."""

import asyncio
from types import SimpleNamespace

import pytest

pytest.importorskip('asyncssh')

from composer.hosts.agent_client import HostAgent, HostLostError


@pytest.mark.parametrize('answer', [b'what?\n', b'{}\n', b'3\n', b'\xff\n'])
def test_what_is_no_answer_is_told(answer):
    async def ask():
        agent = HostAgent(SimpleNamespace(name='rear'))
        agent._process = SimpleNamespace(stdout=asyncio.StreamReader())
        agent._process.stdout.feed_data(answer)
        agent._process.stdout.feed_eof()
        await agent._read()
        await agent.call('look')

    with pytest.raises(HostLostError, match='host rear was lost: it answered '):
        asyncio.run(ask())
