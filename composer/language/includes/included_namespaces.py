"""Namespaces of includes: what is wrong with one is said there, once, and not of all its nodes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from composer.diagnostics import diagnostic_at
from composer.names import find_namespace_fault

if TYPE_CHECKING:
    from composer.language.instances import Instance
    from composer.yaml_text.positions import DataPath


def mend_namespace(instance: Instance, at: DataPath, entry: dict[str, Any]) -> dict[str, Any]:
    """Return an include with a namespace that ROS allows; a finding says if it had another one.

    Args:
        at: The path of the include.
    """
    path = (*at, 'namespace')
    if path in instance.dropped:
        # Without one of their own, its nodes might be called like others.
        return entry | {'namespace': _allowed(str(at[-1]))}
    namespace = entry.get('namespace', '')
    fault = find_namespace_fault(namespace) if namespace else None
    if fault is None:
        return entry
    span = instance.positions.value(path)
    instance.diagnostics.append(diagnostic_at(span, 'bad-name', f"'{namespace}': {fault}"))
    instance.dropped.add(path)
    return entry | {'namespace': _allowed(namespace)}


def _allowed(namespace: str) -> str:
    tokens = (re.sub(r'\W|^(?=\d)', '_', token, flags=re.ASCII) for token in namespace.split('/'))
    slash = '/' if namespace.startswith('/') else ''
    return slash + '/'.join(filter(None, tokens))
