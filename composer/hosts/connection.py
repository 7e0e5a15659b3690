"""Connections to hosts over SSH, as `ssh` itself would make them.

Keys, agent, `known_hosts` and `~/.ssh/config` are those of ssh; what asyncssh reads of them is at
https://asyncssh.readthedocs.io/en/latest/api.html#supported-client-config-options
"""

from __future__ import annotations

import asyncio
import os
import stat
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
            **_without_open_keys(host, _options(host)),
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


def _without_open_keys(host: HostSpec, options: dict[str, Any]) -> dict[str, Any]:
    """Return options that use no file of a key that others can read: ssh does not, either.

    Raises:
        HostConnectionError: There are only such files.
    """
    given = options.get('client_keys') or _resolve(host).config.get('IdentityFile')
    paths = [Path(each).expanduser() for each in given or _list_default_keys()]
    files = [path for path in paths if path.is_file()]
    open_files = [path for path in files if _is_open(path)]
    if not open_files:
        return options
    closed = [str(path) for path in files if path not in open_files]
    if not closed:
        path = open_files[0]
        mode = stat.S_IMODE(path.stat().st_mode)
        message = (
            f"host {host.name}: the key '{path}' is not used, as ssh does not: "
            f'others can read it (mode {mode:o})'
        )
        raise HostConnectionError(message, help=f"chmod 600 '{path}'")
    return {**options, 'client_keys': closed, 'ignore_encrypted': True}


def _list_default_keys() -> list[Path]:
    return [path for path in sorted((Path.home() / '.ssh').glob('id_*')) if path.suffix != '.pub']


def _is_open(path: Path) -> bool:
    """Return whether a key is ours, and others can read it; so does ssh decide.

    Source: `sshkey_perm_ok` of https://github.com/openssh/openssh-portable/blob/master/authfile.c
    """
    found = path.stat()
    return path.suffix != '.pub' and found.st_uid == os.getuid() and bool(found.st_mode & 0o077)


def _resolve(host: HostSpec) -> Any:
    """Return what the configuration of ssh says of a host, without its keys."""
    options = {**_options(host), 'client_keys': None}
    return import_asyncssh().SSHClientConnectionOptions(**options)


def find_real_address(host: HostSpec) -> str:
    """Return the `HostName` that the configuration of ssh has for the address of a host.

    Without one, it is the address itself.

    Raises:
        HostConnectionError: The configuration cannot be read.
    """
    try:
        return _resolve(host).host or host.address
    except ValueError as error:
        message = f'host {host.name} ({host.address}): {error}'
        raise HostConnectionError(message, help='see ~/.ssh/config') from error


def _explain_keys(host: HostSpec) -> HostConnectionError | None:
    """Return which of our files of keys cannot be used; `None` if all can."""
    given = host.identity_file
    paths = [Path(given).expanduser()] if given else _list_default_keys()
    for path in paths:
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
    options = _resolve(host)
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
    elif isinstance(error, OSError) and (number := error.errno or 0) > 0:
        # That of asyncio has the call and its arguments. Failed look-ups have negative numbers.
        reason = os.strerror(number)
    message = f'host {host.name} ({host.address}) cannot be reached: {reason}'
    return HostConnectionError(message)


def _login(host: HostSpec) -> str:
    port = f'-p {host.port} ' if host.port else ''
    return f'{port}{host.user}@{host.address}' if host.user else f'{port}{host.address}'
