"""A deployment: all hosts change together, or none does."""

from __future__ import annotations

import asyncio
import getpass
import os
import socket
from typing import TYPE_CHECKING, Any, Self, TypeVar

from composer.errors import ComposerError
from composer.export.systemd import environment_file_of
from composer.hosts.agent_client import HostAgent
from composer.hosts.host_parts import unit_of
from composer.hosts.host_plan import HostPlan, find_space_problem, plan_host, plan_removal
from composer.hosts.left_hosts import Candidates, has_part
from composer.hosts.moves import order_changes, settle_exchanges

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Collection, Iterable, Mapping, Sequence

    from composer.hosts.host_parts import Part
    from composer.language.specs import HostSpec

    BuildParts = Callable[[Mapping[str, Mapping[str, Any]]], Mapping[str, Part]]

_ResultT = TypeVar('_ResultT')

_HELD_SEC = 50.0
_UP_SEC = 120.0
_RELOAD_SEC = 60.0


class DeployError(ComposerError):
    """A deployment was given up; every host is as it was, but those that the message names."""


class Deployment:
    """The agents of the hosts of a system, while it is entered.

    Args:
        system: Its name.
        tell: Takes lines that say what is done.
    """

    def __init__(
        self, system: str, hosts: Iterable[HostSpec], tell: Callable[[str], None]
    ) -> None:
        self._system = system
        self._tell = tell
        self._agents = {host.name: HostAgent(host) for host in hosts}
        self._facts: dict[str, Mapping[str, Any]] = {}
        self._releases: dict[str, str] = {}
        # The hosts whose part starts.
        self._starting: set[str] = set()

    async def __aenter__(self) -> Self:
        try:
            await self._each(self._open)
        except BaseException:
            await self._close()
            raise
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._close()

    async def _close(self) -> None:
        await asyncio.gather(*(each.close() for each in self._agents.values()))

    async def _open(self, agent: HostAgent) -> None:
        host = agent.host
        await agent.open(
            {
                'folder': host.folder,
                'system': self._system,
                'unit': unit_of(self._system, host),
                'scope': host.systemd,
                'environment_file': environment_file_of(self._system),
            }
        )

    async def look(self) -> Mapping[str, Mapping[str, Any]]:
        """Return what the hosts say of themselves, by their names.

        Raises:
            DeployError: One of them cannot run the system.
        """

        async def look(agent: HostAgent) -> None:
            self._facts[agent.host.name] = await agent.call('look')

        await self._each(look)
        self._facts = {name: self._facts[name] for name in self._agents}
        problems = []
        for name, facts in self._facts.items():
            if facts['systemd_problem']:
                problems.append(f'host {name}: {facts["systemd_problem"]}')
            if not facts['has_venv']:
                python = '.'.join(map(str, facts['python'][:2]))
                problems.append(
                    f'host {name}: its Python has no module venv: install python{python}-venv'
                )
            if not facts['may_run']:
                problems.append(
                    f"host {name}: no program may be run from '{facts['folder']}', whose disk is "
                    "mounted with noexec: choose a folder on another one by 'folder:'"
                )
        if problems:
            raise DeployError('\n'.join(problems))
        return self._facts

    def check_variables(self, needed: Iterable[str]) -> None:
        """Check that what the files read from the environment is set on all hosts.

        Args:
            needed: The names of the variables.

        Raises:
            DeployError: Some of them are not.
        """
        problems, files = [], []
        for name, facts in self._facts.items():
            missing = [each for each in needed if each not in facts['variables']]
            if missing:
                problems.append(f'host {name}: not set there: {", ".join(missing)}')
                files.append(facts['environment_file'])
        if problems:
            listed = ' or '.join(dict.fromkeys(files))
            advice = f'the files read them by env(…): there, write NAME="value" into {listed}'
            raise DeployError('\n'.join(problems), help=advice)

    async def lock(self) -> None:
        """Keep other deployments away, and take back what one has left that was cut off.

        Raises:
            DeployError: There is one under way.
        """
        await self._each(_lock)

    async def repair(self) -> None:
        """Take back what a deployment has left that was cut off."""
        await self._each(self._repair)

    async def _repair(self, agent: HostAgent) -> None:
        name = agent.host.name
        if self._facts[name]['is_pending']:
            told = await agent.call('roll_back')
            self._tell(f'{name}: an earlier deployment was cut off: {told}')
            self._facts[name] = await agent.call('look')

    async def find_left(
        self,
        inventory: Mapping[str, HostSpec],
        wanted: Collection[str],
        leave: Collection[str],
        *,
        locks: bool,
    ) -> None:
        """Find the hosts that have a part of the system, and are to have none any more.

        They are those of the inventory, and those that the releases on the other hosts name.

        Args:
            wanted: The names of those to change; empty for all.
            leave: The names of those to leave as they are.
            locks: Whether to lock them, and to take back what was cut off there.

        Raises:
            DeployError: One that may have a part cannot be asked.
        """
        candidates = Candidates(self._facts, inventory, wanted)
        hosts = candidates.list_asked(leave)
        asked = [HostAgent(host) for host in hosts]
        for agent in asked:
            # They are closed with the others.
            self._agents[agent.host.name] = agent

        async def ask(agent: HostAgent) -> None:
            name = agent.host.name
            facts = await self._ask(agent, is_must=name in candidates.musts)
            if facts is not None and has_part(facts, self._system, name):
                self._facts[name] = facts
                if locks:
                    await _lock(agent)
                    self._facts[name] = await agent.call('look')
                    await self._repair(agent)
                if has_part(self._facts[name], self._system, name):
                    return
                del self._facts[name]
            if facts is not None and name in wanted:
                self._tell(f'{name}: there is nothing of {self._system}')
            await self._agents.pop(name).close()

        await self._each(ask, asked)

    async def _ask(self, agent: HostAgent, *, is_must: bool) -> Mapping[str, Any] | None:
        """Return what a host says of itself that has no part; `None` if it cannot be asked."""
        name = agent.host.name
        try:
            await self._open(agent)
            facts: Mapping[str, Any] = await agent.call('look')
        except ComposerError as error:
            unknown = f'whether {self._system} still runs there is not known'
            if not is_must:
                self._tell(f'warning: {error}: {unknown}')
                return None
            message = f'{error}: {unknown}'
            advice = f"'--leave {name}' leaves it as it is, and forgets it"
            helps = filter(None, [error.help, advice])
            raise DeployError(message, help='\n'.join(helps)) from error
        return facts

    def plan(self, parts: Mapping[str, Part]) -> list[HostPlan]:
        """Return what is to be done on each host."""

        def plan(name: str, facts: Mapping[str, Any]) -> HostPlan:
            if name in parts:
                return plan_host(parts[name], facts)
            return plan_removal(self._agents[name].host, facts)

        return settle_exchanges([plan(*each) for each in self._facts.items()])

    def check(self, plans: Sequence[HostPlan]) -> None:
        """Check that nothing stands against the plans.

        Raises:
            DeployError: A file would be overwritten that somebody else has written, or a disk is
                too small.
        """
        conflicts = [
            f'host {each.part.host.name}: {line}' for each in plans for line in each.conflicts
        ]
        if conflicts:
            advice = 'take an edit over into the files here, or remove the file there'
            raise DeployError('\n'.join(conflicts), help=advice)
        found = (find_space_problem(each, self._facts[each.part.host.name]) for each in plans)
        problems = [each for each in found if each is not None]
        if problems:
            advice = "free some space, or choose a folder on another disk by 'folder:'"
            raise DeployError('\n'.join(problems), help=advice)

    async def apply(self, plans: Sequence[HostPlan]) -> None:
        """Let all hosts become what their plans say.

        Raises:
            DeployError: One of them failed, and all are as they were before.
        """
        changed = {each.part.host.name: each for each in plans if each.action != 'nothing'}
        agents = [self._agents[name] for name in changed]
        groups = [
            [self._agents[each.part.host.name] for each in group]
            for group in order_changes(list(changed.values()))
        ]

        async def each(step: Callable[[HostAgent], Awaitable[_ResultT]]) -> None:
            await self._each(step, agents)

        try:
            await each(lambda agent: self._prepare(agent, changed[agent.host.name]))
            await each(lambda agent: agent.call('begin'))
            for group in groups:
                await self._each(
                    lambda agent: self._switch(agent, changed[agent.host.name]), group
                )
            await each(self._hold)
            await each(lambda agent: agent.call('let_go'))
            await each(self._wait_until_up)
            await each(lambda agent: self._confirm(agent, changed[agent.host.name]))
        except BaseException as error:
            told = await asyncio.shield(self._roll_back(groups[::-1]))
            if not isinstance(error, ComposerError):
                for line in told:
                    self._tell(line)
                raise
            raise DeployError('\n'.join([str(error), *told]), help=error.help) from error
        await asyncio.shield(self._commit(changed))

    async def _prepare(self, agent: HostAgent, plan: HostPlan) -> None:
        if plan.action == 'remove':
            return
        part, name = plan.part, agent.host.name
        for digest in plan.blobs:
            await agent.bring('receive', digest, part.blobs[digest])
        if not plan.has_composer:
            await agent.bring('receive', part.composer.name, part.composer.data)
            digest = part.manifest['composer']
            await agent.call('unpack_composer', digest=digest, wheel=part.composer.name)
        for wheel in plan.wheels:
            await agent.bring('receive_wheel', wheel, part.wheels[wheel].read_bytes())
        if part.manifest['venv'] not in self._facts[name]['venvs']:
            self._tell(f'{name}: installing {len(part.wheels)} packages')
        await agent.call(
            'provide_venv',
            digest=part.manifest['venv'],
            wheels=sorted(part.wheels),
            sees_system=part.sees_system,
        )
        self._releases[name] = await agent.call('stage', manifest=part.manifest)
        if part.build:
            self._tell(f'{name}: building interface packages')
            await agent.call('run_release', release=self._releases[name], words=part.build)

    async def _switch(self, agent: HostAgent, plan: HostPlan) -> None:
        part, name = plan.part, agent.host.name
        if plan.action == 'remove':
            await agent.call('leave')
            self._tell(f'{name}: stopped')
            return
        release = self._releases[name]
        if plan.action == 'reload':
            told = await agent.call(
                'reload',
                release=release,
                name=part.name,
                timeout_sec=_RELOAD_SEC,
            )
            for line in told.splitlines():
                self._tell(f'{name}: {line.removeprefix(f"{part.name}: ")}')
        else:
            self._starting.add(name)
            self._tell(f'{name}: starting')
            await agent.call('switch', release=release, unit=part.unit, start=part.start)

    async def _hold(self, agent: HostAgent) -> None:
        if agent.host.name in self._starting:
            await agent.call('wait_until_held', timeout_sec=_HELD_SEC)

    async def _wait_until_up(self, agent: HostAgent) -> None:
        if agent.host.name in self._starting:
            await agent.call('wait_until_up', timeout_sec=_UP_SEC)
            self._tell(f'{agent.host.name}: up')

    async def _confirm(self, agent: HostAgent, plan: HostPlan) -> None:
        if plan.action != 'remove':
            await agent.call('confirm')

    async def _roll_back(self, groups: Iterable[Iterable[HostAgent]]) -> list[str]:
        """Take back what was done, a group after the other; return what became of each host."""

        async def roll_back(agent: HostAgent) -> str:
            name = agent.host.name
            lost = f'{name}: lost; it goes back by itself, or at the next deployment'
            if agent.is_lost:
                return lost
            try:
                return f'{name}: {await agent.call("roll_back")}'
            except ComposerError as error:
                return lost if agent.is_lost else f'{error}'

        told = [await asyncio.gather(*map(roll_back, group)) for group in groups]
        return [line for lines in told for line in lines]

    async def _commit(self, plans: Mapping[str, HostPlan]) -> None:

        async def commit(name: str) -> None:
            agent = self._agents[name]
            if plans[name].action == 'remove':
                await self._remove(agent)
            else:
                await agent.call('commit')

        found = await asyncio.gather(*map(commit, plans), return_exceptions=True)
        errors = [str(each) for each in found if isinstance(each, ComposerError)]
        if errors:
            errors.append(
                'It may run the release before: deploy again when it is back, with its name '
                'in the inventory.'
            )
            raise DeployError('\n'.join(errors))

    async def remove(self) -> None:
        """Stop the system on all hosts, and remove what was written for it."""

        async def remove(agent: HostAgent) -> None:
            name = agent.host.name
            if self._facts[name]['release'] is None:
                self._tell(f'{name}: there is nothing of {self._system}')
                return
            await self._remove(agent)

        await self._each(remove)

    async def _remove(self, agent: HostAgent) -> None:
        left = await agent.call('remove')
        self._tell(f'{agent.host.name}: removed')
        for path in left:
            self._tell(f'{agent.host.name}: {path} was edited there, and is kept')

    async def _each(
        self,
        step: Callable[[HostAgent], Awaitable[_ResultT]],
        agents: Iterable[HostAgent] | None = None,
    ) -> list[_ResultT]:
        """Do a step on all hosts at the same time.

        Raises:
            DeployError: It failed on some; all have ended it.
        """
        chosen = list(self._agents.values()) if agents is None else list(agents)
        found = await asyncio.gather(*map(step, chosen), return_exceptions=True)
        errors = [each for each in found if isinstance(each, BaseException)]
        for error in errors:
            if not isinstance(error, ComposerError):
                raise error
        if errors:
            helps = dict.fromkeys(filter(None, (getattr(each, 'help', None) for each in errors)))
            raise DeployError('\n'.join(map(str, errors)), help='\n'.join(helps) or None)
        return [each for each in found if not isinstance(each, BaseException)]


async def _lock(agent: HostAgent) -> None:
    owner = f'{getpass.getuser()}@{socket.gethostname()} (process {os.getpid()})'
    await agent.call('lock', owner=owner)
