"""Connections to hosts over SSH, as `ssh` itself would make them.

Keys, agent, `known_hosts` and `~/.ssh/config` are those of ssh; what asyncssh reads of them is at
https://asyncssh.readthedocs.io/en/latest/api.html#supported-client-config-options
"""

from __future__ import annotations

import asyncio
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError

if TYPE_CHECKING:
    import asyncssh as asyncssh_types

    from composer.language.specs import HostSpec

_CONNECT_SEC = 10.0
_LOGIN_SEC = 20.0
_KEEPALIVE_SEC = 5.0
_MOST_UNANSWERED = 3


class HostConnectionError(ComposerError):
    """A host cannot be reached, or does not let us in."""


async def connect(host: HostSpec) -> asyncssh_types.SSHClientConnection:
    """Connect to a host.

    Raises:
        HostConnectionError: It cannot be reached, its key is not known, or no key of ours is.
    """
    asyncssh = import_asyncssh()
    try:
        connection: asyncssh_types.SSHClientConnection = await asyncssh.connect(
            **_options(host),
            login_timeout=_LOGIN_SEC,
            keepalive_interval=_KEEPALIVE_SEC,
            keepalive_count_max=_MOST_UNANSWERED,
        )
    except asyncssh.HostKeyNotVerifiable as error:
        raise await _explain_host_key(host, error) from error
    except asyncssh.PermissionDenied as error:
        message = f'host {host.name} ({host.address}) accepts none of our keys'
        advice = (
            f"'ssh {_login(host)}' must work without a password: ssh-copy-id brings a key; "
            'one with a passphrase must be in the agent (ssh-add)'
        )
        raise HostConnectionError(message, help=advice) from error
    except (OSError, asyncssh.Error, TimeoutError) as error:
        found = _explain_keys(host) if host.identity_file else None
        raise found or _unreachable(host, error) from error
    except ValueError as error:
        message = f'host {host.name} ({host.address}): {error}'
        unknown = HostConnectionError(message, help='see ~/.ssh/config')
        raise _explain_keys(host) or unknown from error
    return connection


def import_asyncssh() -> Any:
    """Return the module asyncssh.

    Raises:
        ComposerError: It is not installed.
    """
    try:
        import asyncssh
    except ImportError as error:
        message = 'hosts are reached by asyncssh, which is not installed'
        advice = "pip install 'rclpy-composer[hosts]'"
        raise ComposerError(message, help=advice) from error
    asyncssh.set_log_level('CRITICAL')
    return asyncssh


def _options(host: HostSpec) -> dict[str, Any]:
    options: dict[str, Any] = {'host': host.address, 'connect_timeout': _CONNECT_SEC}
    configs = [Path.home() / '.ssh' / 'config', Path('/etc/ssh/ssh_config')]
    options['config'] = [str(path) for path in configs if path.is_file()] or None
    if host.port is not None:
        options['port'] = host.port
    if host.user:
        options['username'] = host.user
    if host.identity_file:
        options['client_keys'] = [str(Path(host.identity_file).expanduser())]
        # The agent may have it, as that of keys in ~/.ssh/config.
        options['ignore_encrypted'] = True
    return options


def _explain_keys(host: HostSpec) -> HostConnectionError | None:
    """Return which of our files of keys cannot be used; `None` if all can."""
    given = host.identity_file
    folder = Path.home() / '.ssh'
    paths = [Path(given).expanduser()] if given else sorted(folder.glob('id_*'))
    for path in paths:
        if not given and path.suffix == '.pub':
            continue
        try:
            import_asyncssh().load_keypairs([str(path)], ignore_encrypted=True)
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else error
            message = f"host {host.name}: the key '{path}' cannot be used: {reason}"
            if isinstance(error, ValueError) and path.with_name(f'{path.name}.pub').exists():
                return HostConnectionError(message, help=f"is '{path}.pub' that of another key?")
            return HostConnectionError(message)
    return None


async def _explain_host_key(host: HostSpec, error: Exception) -> HostConnectionError:
    """Return what ssh would say of the key of a host."""
    asyncssh = import_asyncssh()
    key = None
    with suppress(OSError, asyncssh.Error, ValueError):
        options = {name: value for name, value in _options(host).items() if name in _KEY_OPTIONS}
        found = asyncssh.get_server_host_key(**options)
        key = await asyncio.wait_for(found, _LOGIN_SEC)
    fingerprint = key.get_fingerprint() if key is not None else str(error)
    if _is_known(host):
        message = (
            f'host {host.name} ({host.address}) has another key than known_hosts says: '
            f'{fingerprint}. Somebody may be listening'
        )
        advice = f"if the host was set up anew: ssh-keygen -R '{host.address}', then ssh to it"
        return HostConnectionError(message, help=advice)
    message = f'the key of host {host.name} ({host.address}) is not known: {fingerprint}'
    advice = (
        f"compare it with the host's own, and accept it by 'ssh {_login(host)}', which asks "
        "'Are you sure you want to continue connecting?'"
    )
    return HostConnectionError(message, help=advice)


_KEY_OPTIONS = ('host', 'port', 'config')


def _is_known(host: HostSpec) -> bool:
    """Return whether there is a key of this host."""
    asyncssh = import_asyncssh()
    options = asyncssh.SSHClientConnectionOptions(**_options(host))
    names = {host.address, options.host, options.host_key_alias} - {None, ''}
    for path in (Path.home() / '.ssh/known_hosts', Path('/etc/ssh/ssh_known_hosts')):
        for name in names:
            with suppress(OSError, ValueError):
                if any(asyncssh.read_known_hosts(str(path)).match(name, '', options.port)[:2]):
                    return True
    return False


def _unreachable(host: HostSpec, error: Exception) -> HostConnectionError:
    reason = str(error) or 'no answer'
    if isinstance(error, TimeoutError):
        reason = f'no answer within {_CONNECT_SEC:g} s'
    message = f'host {host.name} ({host.address}) cannot be reached: {reason}'
    return HostConnectionError(message)


def _login(host: HostSpec) -> str:
    port = f'-p {host.port} ' if host.port else ''
    return f'{port}{host.user}@{host.address}' if host.user else f'{port}{host.address}'
