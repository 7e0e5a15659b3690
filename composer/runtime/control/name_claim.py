"""The name of a system on its host: one system at a time has it.

It is an abstract socket of Linux, which one process can be bound to. The kernel takes it back when
the process ends, however that happens; network namespaces, as of containers, have names of their
own, as they have ROS graphs of their own. Who connects is told who has the name. Of
systems on other hosts `SameNames` warns.
"""

from __future__ import annotations

import json
import os
import re
import socket
import struct
import threading
import time
import weakref
from contextlib import suppress
from pathlib import Path
from typing import Any

_PREFIX = 'composer-system'
_ANSWER_SEC = 1.0
_MOST_BYTES = 65536
_CREDENTIALS = struct.Struct('3i')
# What decides which processes of a host are on one graph.
_GRAPH_VARIABLES = ('RMW_IMPLEMENTATION', 'ROS_DISCOVERY_SERVER')


class NameClaim:
    """The claim of this process to the name of a system.

    Args:
        node: The full name of the control node.
        domain_id: The ROS domain.
    """

    def __init__(self, node: str, domain_id: int) -> None:
        self._address = find_address(node, domain_id)
        self._socket: socket.socket | None = None

    def take(self, about: dict[str, Any]) -> dict[str, Any] | None:
        """Take the name; return what is known of who has it, `None` if that is this process now.

        Args:
            about: What others are told of this process.
        """
        if os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE') == 'OFF':
            return None  # It is alone on its graph.
        claim = socket.socket(socket.AF_UNIX)
        deadline = time.monotonic() + _ANSWER_SEC
        while True:
            try:
                claim.bind(self._address)
                break
            except OSError:
                # Nobody has it if that process ended meanwhile; or it does not listen yet.
                owner = ask(self._address)
                if owner is not None or time.monotonic() > deadline:
                    claim.close()
                    return owner or {}
        claim.listen()
        self._socket = claim
        _claims.add(claim)
        answer = json.dumps(about).encode()
        self._thread = threading.Thread(
            target=_answer, args=(claim, answer), name='composer-name', daemon=True
        )
        self._thread.start()
        return None

    def release(self) -> None:
        """Let others have the name."""
        if self._socket is not None:
            # Wakes the thread that waits for connections, too.
            with suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)
            self._socket.close()
            self._thread.join(_ANSWER_SEC)


def list_claims(domain_id: int) -> list[dict[str, Any]]:
    """Return what the systems on this host say of themselves that are on the same graph.

    The `address` of their socket and the `pid` are known even of those that say nothing.
    """
    prefix = f'@{find_address("", domain_id)[1:]}'
    try:
        text = Path('/proc/net/unix').read_text(encoding='utf-8', errors='replace')
    except OSError:
        return []
    names = {each for each in re.findall(r'@\S+$', text, re.MULTILINE) if each.startswith(prefix)}
    addresses = [f'\0{name[1:]}' for name in sorted(names)]
    asked = ((address, ask(address)) for address in addresses)
    return [{**each, 'address': address} for address, each in asked if each]


def ask(address: str) -> dict[str, Any] | None:
    """Return what is known of who has a name, which may be nothing; `None` if nobody has it."""
    with socket.socket(socket.AF_UNIX) as peer:
        peer.settimeout(_ANSWER_SEC)
        try:
            peer.connect(address)
        except OSError as error:
            # One that is stopped answers nobody, and then its queue is full.
            return None if isinstance(error, ConnectionRefusedError) else {}
        credentials = peer.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        pid, _, _ = _CREDENTIALS.unpack(credentials)
        try:
            about = json.loads(peer.recv(_MOST_BYTES, socket.MSG_WAITALL))
        except (OSError, ValueError, RecursionError):
            about = {}
    return {**about, 'pid': pid} if isinstance(about, dict) else {'pid': pid}


def find_address(node: str, domain_id: int) -> str:
    """Return the address of the socket of a control node; without one, how all addresses begin."""
    import hashlib  # A worker starts faster without it.

    graph = '\0'.join(os.environ.get(name, '') for name in _GRAPH_VARIABLES)
    digests = [hashlib.sha256(each.encode()).hexdigest()[:16] for each in (graph, node) if each]
    own = digests[1] if node else ''
    return f'\0{_PREFIX}/{domain_id}/{digests[0]}/{own}'


def _answer(claim: socket.socket, answer: bytes) -> None:
    with suppress(OSError, ValueError):
        while True:
            peer, _ = claim.accept()
            with peer, suppress(OSError):
                peer.setblocking(False)
                peer.sendall(answer)


_claims: weakref.WeakSet[socket.socket] = weakref.WeakSet()


def _close_in_child() -> None:
    # A child that outlives the system must not keep its name.
    for claim in tuple(_claims):
        claim.close()


os.register_at_fork(after_in_child=_close_in_child)
