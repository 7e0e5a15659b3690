"""Checks the answers of systems: whoever is on the ROS graph may have sent them."""

from __future__ import annotations

import json
from types import NoneType
from typing import Any, Final, TypeAlias

from composer.errors import ComposerError
from composer.runtime.control import protocol

# A type; a mapping of the keys that must be there, or of `str` for any; a list of one form; or a
# tuple of alternatives.
Form: TypeAlias = Any

_FIGURE = (NoneType, float)
ANY: Final[Form] = {}
_EXTERNAL: Final[Form] = {
    **dict.fromkeys(('name', 'state', 'level', 'message'), str),
    'restarts': int,
    **dict.fromkeys(('pid', 'cpu', 'memory_bytes'), _FIGURE),
}
_GIVEN = ('layers', 'words', 'set_values', 'stopped')
SNAPSHOT: Final[Form] = {'given': {key: [str] for key in _GIVEN}}
STATUS: Final[Form] = {
    **dict.fromkeys(('name', 'file', 'host', 'state', 'last_error'), str),
    'pid': int,
    'uptime_sec': float,
    'nodes': [str],
    'components': [str],
    'stopped': [str],
    'lifecycles': {str: str},
    'awaited': {str: str},
    'external_processes': [_EXTERNAL],
    'workers': [{'name': str}],
    'health': (NoneType, {'level': str, 'message': str}),
    'last_reload': (NoneType, {'time': float, 'succeeded': bool}),
}
TOP: Final[Form] = {
    'name': str,
    'period': int,
    'period_sec': float,
    'has_cpu': bool,
    'external_processes': [_EXTERNAL],
    'processes': [
        {
            'worker': str,
            'pid': int,
            'cores': int,
            **dict.fromkeys(('cpu', 'gil_wait_mean_ms', 'gil_wait_max_ms'), _FIGURE),
        }
    ],
    'entities': [
        {
            **dict.fromkeys(('node', 'worker', 'kind', 'name', 'key'), str),
            **dict.fromkeys(('rate_hz', 'mean_ms', 'p50_ms', 'p99_ms', 'max_ms'), _FIGURE),
            **dict.fromkeys(('delivery_p50_ms', 'delivery_p99_ms', 'cpu', 'queued'), _FIGURE),
            **dict.fromkeys(('errors', 'dropped', 'late', 'skipped'), float),
            'delivery': (NoneType, str),
            'delivery_reason': str,
        }
    ],
}
# More than any figure, and few enough to be printed.
_MOST = 1e18


def read_answer(text: str, form: Form = ANY) -> dict[str, Any]:
    """Return the data of an answer.

    Raises:
        ComposerError: It is of another version of Composer, or of somebody else.
    """
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        data = None
    is_ours = isinstance(data, dict) and data.get('version') == protocol.VERSION
    if not is_ours or not _fits(data, form):
        message = 'a system answers in a form that this version of Composer does not know'
        raise ComposerError(message, help='use the version that the system runs with')
    return dict(data)


def _fits(data: Any, form: Form) -> bool:
    if isinstance(form, dict) and str in form:
        return isinstance(data, dict) and all(_fits(each, form[str]) for each in data.values())
    if isinstance(form, dict):
        return isinstance(data, dict) and all(
            key in data and _fits(data[key], each) for key, each in form.items()
        )
    if isinstance(form, list):
        return isinstance(data, list) and all(_fits(each, form[0]) for each in data)
    if isinstance(form, tuple):
        return any(_fits(data, each) for each in form)
    if form is float or form is int:
        kinds = (int, float) if form is float else int
        return isinstance(data, kinds) and not isinstance(data, bool) and abs(data) < _MOST
    return isinstance(data, form)
