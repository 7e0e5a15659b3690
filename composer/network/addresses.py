"""What is an address: of IP, or a name that DNS or the configuration of ssh may know."""

from __future__ import annotations

import ipaddress
import re

_LABEL = r'(?!-)[A-Za-z0-9_-]{1,63}(?<!-)'
_NAME = re.compile(rf'{_LABEL}(\.{_LABEL})*\.?')
_NUMBERS = re.compile(r'[\d.]+')
# A host that others look for here is looked for on their own computers.
_LOOPBACK_NAME = 'localhost'


def is_address(text: str) -> bool:
    """Return whether a text can be an address. One of numbers must be one of IP."""
    return _read_ip(text) is not None or bool(
        _NAME.fullmatch(text) and not _NUMBERS.fullmatch(text)
    )


def is_loopback(text: str) -> bool:
    """Return whether an address is that of the computer that uses it."""
    found = _read_ip(text)
    return found.is_loopback if found else text.rstrip('.').lower() == _LOOPBACK_NAME


def normalise_address(text: str) -> str:
    """Return an address so that those of one computer are the same, as far as their texts say."""
    return _LOOPBACK_NAME if is_loopback(text) else str(_read_ip(text) or text)


def _read_ip(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(text)
    except ValueError:
        return None
