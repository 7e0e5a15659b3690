"""The environment variables that ROS reads: those of a file, and those of the shell."""

from __future__ import annotations

import re
from itertools import chain
from typing import TYPE_CHECKING

from composer.ament import ament_prefixes
from composer.spelling import did_you_mean, is_typo, suggest

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import WorkerSpec
    from composer.yaml_text.positions import DataPath

_RMW_INDEX = 'share/ament_index/resource_index/rmw_typesupport'
# What of that index are no middlewares themselves.
_NO_RMW = ('rmw_implementation',)
_MIDDLEWARES = ('RMW_IMPLEMENTATION', 'RCL_ASSERT_RMW_ID_MATCHES')
_TRANSPORTS = 'FASTDDS_BUILTIN_TRANSPORTS'
# The highest domain whose ports exist (https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Domain-ID.html).
_MAX_DOMAIN = 232
# With any other value ROS complains, loses its log, or does without what is asked for (`logging.c`
# of rcutils, `security.c` and `node.c` of rcl, `discovery_options.c` of rmw, `participant.cpp` of
# rmw_fastrtps, `RTPSParticipantAttributes.cpp` of Fast DDS).
_CHOICES = {
    _TRANSPORTS: (
        'DEFAULT',
        'DEFAULTv6',
        'LARGE_DATA',
        'LARGE_DATAv6',
        'NONE',
        'P2P',
        'SHM',
        'UDPv4',
        'UDPv6',
    ),
    'RCUTILS_COLORIZED_OUTPUT': ('0', '1'),
    'RCUTILS_LOGGING_BUFFERED_STREAM': ('0', '1'),
    'RCUTILS_LOGGING_USE_STDOUT': ('0', '1'),
    'RMW_FASTRTPS_PUBLICATION_MODE': ('SYNCHRONOUS', 'ASYNCHRONOUS', 'AUTO'),
    'RMW_FASTRTPS_USE_QOS_FROM_XML': ('0', '1'),
    'ROS_AUTOMATIC_DISCOVERY_RANGE': ('SUBNET', 'LOCALHOST', 'OFF', 'SYSTEM_DEFAULT'),
    'ROS_DISABLE_LOANED_MESSAGES': ('0', '1'),
    'ROS_LOCALHOST_ONLY': ('0', '1'),
    'ROS_SECURITY_ENABLE': ('true', 'false'),
    'ROS_SECURITY_STRATEGY': ('Enforce', 'Permissive'),
}
# What else ROS and its middlewares read, or tools set.
_OTHERS = (
    'FASTDDS_DEFAULT_PROFILES_FILE FASTDDS_ENVIRONMENT_FILE FASTDDS_STATISTICS '
    'FASTRTPS_DEFAULT_PROFILES_FILE RCUTILS_CONSOLE_OUTPUT_FORMAT '
    'RCUTILS_CONSOLE_STDOUT_LINE_BUFFERED ROS_DISCOVERY_SERVER ROS_DISTRO ROS_DOMAIN_ID '
    'ROS_ETC_DIR ROS_HOME ROS_LOG_DIR ROS_PYTHON_VERSION ROS_SECURITY_ENCLAVE_OVERRIDE '
    'ROS_SECURITY_KEYSTORE ROS_STATIC_PEERS ROS_SUPER_CLIENT ROS_VERSION'
)
_VARIABLES = frozenset((*_CHOICES, *_MIDDLEWARES, *_OTHERS.split(' ')))
_PREFIXES = ('FASTDDS_', 'FASTRTPS_', 'RCL_', 'RCUTILS_', 'RMW_', 'ROS_')
_LONGEST_PEER = 255
# What C reads as a number: no digits of other scripts, and not thousands of them.
_NUMBER = re.compile('[0-9]{1,9}')


def check_environment(context: CheckContext) -> Iterator[Diagnostic]:
    """Check the values that a file gives to the variables that ROS reads."""
    for name, message, advice in find_environment_problems(context.spec.environment):
        yield context.at_value(('environment', name), 'bad-environment', message, help=advice)
    for name in context.spec.environment:
        yield from _check_variable(context, ('environment', name))
    for worker in context.spec.workers.values():
        yield from _check_worker(context, worker)
    for process in context.spec.processes.values():
        for name in process.env:
            yield from _check_variable(context, (*process.path, 'env', name))
        # Which middlewares there are where it runs, as in a container, nobody knows.
        for name, message, advice in _find_bad_values(process.env):
            path = (*process.path, 'env', name)
            yield context.at_value(path, 'bad-environment', message, help=advice)


def _check_worker(context: CheckContext, worker: WorkerSpec) -> Iterator[Diagnostic]:
    """Check the variables of a worker, in which the rest of the system must find its nodes."""
    for name in worker.environment:
        yield from _check_variable(context, (*worker.path, 'environment', name))
    problems = [*find_environment_problems(worker.environment)]
    domain = worker.environment.get('ROS_DOMAIN_ID')
    if not problems and domain and domain != context.spec.environment.get('ROS_DOMAIN_ID'):
        message = 'a worker in another ROS domain than the system sees nothing of it'
        problems.append(('ROS_DOMAIN_ID', message, "set it for all, under 'environment:'"))
    for name, message, advice in problems:
        path = (*worker.path, 'environment', name)
        yield context.at_value(path, 'bad-environment', message, help=advice)


def _check_variable(context: CheckContext, path: DataPath) -> Iterator[Diagnostic]:
    """Check that the name of a variable is not nearly one that ROS reads."""
    name = str(path[-1])
    if name not in _VARIABLES and name.upper().startswith(_PREFIXES):
        begins = (each for each in sorted(_VARIABLES) if each.startswith(f'{name.upper()}_'))
        typos = (each for each in sorted(_VARIABLES) if is_typo(name, each))
        same = (each for each in (name.upper(),) if each in _VARIABLES)
        meant = next(chain(same, typos, begins), None)
        if meant:
            message = f"ROS reads no variable '{name}'"
            yield context.at_key(path, 'likely-misspelling', message, help=did_you_mean(meant))


def find_environment_problems(
    variables: Mapping[str, str],
) -> Iterator[tuple[str, str, str | None]]:
    """Yield the variables that ROS cannot use, each with a message and help.

    Variables that are empty count as not set, as they do for ROS.
    """
    installed = installed_middlewares()
    for name in _MIDDLEWARES:
        middleware = variables.get(name)
        if middleware and installed and middleware not in installed:
            message = f"{name}: no middleware '{middleware}' is installed"
            yield name, message, suggest(middleware, installed, 'there are')
    yield from _find_bad_values(variables)


def _find_bad_values(variables: Mapping[str, str]) -> Iterator[tuple[str, str, str | None]]:
    domain = variables.get('ROS_DOMAIN_ID')
    if domain and not (_NUMBER.fullmatch(domain) and int(domain) <= _MAX_DOMAIN):
        message = f'ROS_DOMAIN_ID is a number from 0 to {_MAX_DOMAIN}, not {domain!r}'
        yield 'ROS_DOMAIN_ID', message, None
    for name, choices in _CHOICES.items():
        value = variables.get(name)
        # Options of the transports follow a question mark.
        word = value.partition('?')[0] if value and name == _TRANSPORTS else value
        if word and word not in choices:
            yield name, f'{name} is {" or ".join(choices)}, not {value!r}', suggest(word, choices)
    for peer in variables.get('ROS_STATIC_PEERS', '').split(';'):
        if len(peer) > _LONGEST_PEER:
            message = f'a peer in ROS_STATIC_PEERS has at most {_LONGEST_PEER} characters'
            yield 'ROS_STATIC_PEERS', message, None


def installed_middlewares() -> list[str]:
    """Return the RMW implementations that ROS can load; none without ROS."""
    folders = [prefix / _RMW_INDEX for prefix in ament_prefixes()]
    names = {entry.name for folder in folders if folder.is_dir() for entry in folder.iterdir()}
    return sorted(names.difference(_NO_RMW))
