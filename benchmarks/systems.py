"""Systems for `composer up` to run, as text."""

from typing import Any

import yaml

_TYPE = 'std_msgs/msg/Empty'


def render_system(nodes: dict[str, Any], *, local_delivery: bool = True) -> str:
    """Return a file that declares `nodes`."""
    defaults = {'local_delivery': local_delivery}
    return yaml.safe_dump({'version': 1, 'defaults': defaults, 'nodes': nodes}, sort_keys=False)


def idle_nodes(count: int, *, parameters: bool = False) -> dict[str, Any]:
    """Return nodes that do nothing, each with a publisher and a subscription of its own.

    Args:
        parameters: Whether they have a parameter and parameter services; if not, they are as lean
            as a file can make them.
    """
    return {f'idle_{number}': _idle_node(number, parameters) for number in range(count)}


def _idle_node(number: int, parameters: bool) -> dict[str, Any]:  # noqa: FBT001
    topic = f'idle_topic_{number}'
    node = {
        'publishers': {'out': {'type': _TYPE, 'topic': topic}},
        'subscriptions': {
            'in': {
                'type': _TYPE,
                'topic': topic,
                'behaviour': 'benchmarks.behaviours:ignore',
            }
        },
    }
    own = {'parameters': {'speed': 1.0}} if parameters else {'parameter_services': False}
    return own | node


def busy_nodes(count: int) -> dict[str, Any]:
    """Return nodes with five entities each, which do something once a second."""
    return {f'busy_{number}': _busy_node(number, count) for number in range(count)}


def _busy_node(number: int, count: int) -> dict[str, Any]:
    behaviour = 'benchmarks.behaviours:ignore'
    return {
        'publishers': {'out': {'type': _TYPE, 'topic': f'busy_topic_{number}'}},
        'subscriptions': {
            'in': {'type': _TYPE, 'topic': f'busy_topic_{number}', 'behaviour': behaviour},
            'next': {
                'type': _TYPE,
                'topic': f'busy_topic_{(number + 1) % count}',
                'behaviour': behaviour,
                'qos': 5,
            },
        },
        'services': {
            'reset': {
                'type': 'std_srvs/srv/Empty',
                'service': '~/reset',
                'behaviour': f'{behaviour}_request',
            }
        },
        'timers': {'tick': {'period': 1.0, 'publish': 'out', 'message': {}}},
    }


def rally(seconds: float) -> dict[str, Any]:
    """Return two nodes that play ping-pong, print how many round trips a second, and stop."""
    return {
        'first': {
            'state': {'count': 0},
            'publishers': {'ping': _TYPE},
            'subscriptions': {
                'pong': {'type': _TYPE, 'behaviour': 'benchmarks.behaviours:return_ball'}
            },
            'timers': {
                'referee': {
                    'period': 0.2,
                    'behaviour': 'benchmarks.behaviours:count_round_trips',
                    'with': {'seconds': seconds},
                }
            },
        },
        'second': {
            'publishers': {'pong': _TYPE},
            'subscriptions': {
                'ping': {'type': _TYPE, 'behaviour': 'benchmarks.behaviours:hit_back'}
            },
        },
    }


def callers(seconds: float, timeout: float | None, *, is_async: bool) -> dict[str, Any]:
    """Return two nodes: one calls the other, prints how many calls a second, and stops."""
    behaviour = f'benchmarks.behaviours:call_often{"_async" if is_async else ""}'
    service = 'std_srvs/srv/SetBool'
    return {
        'calling': {
            'service_clients': {'ask': service},
            'timers': {
                'call': {
                    'period': 0.2,
                    'behaviour': behaviour,
                    'with': {'seconds': seconds, 'timeout': timeout},
                }
            },
        },
        'serving': {
            'services': {'ask': {'type': service, 'behaviour': 'benchmarks.behaviours:comply'}},
        },
    }


def stream(seconds: float, rate: int) -> dict[str, Any]:
    """Return two nodes: `rate` messages a second from one to the other, which prints the count."""
    numbers = 'std_msgs/msg/Int64'
    return {
        'source': {
            'publishers': {'numbers': {'type': numbers, 'qos': rate}},
            'timers': {
                'emit': {
                    'rate': rate,
                    'behaviour': 'benchmarks.behaviours:emit',
                    'with': {'seconds': seconds, 'per_sec': rate},
                }
            },
        },
        'sink': {
            'state': {'got': 0},
            'subscriptions': {
                'numbers': {
                    'type': numbers,
                    'qos': rate,
                    'behaviour': 'benchmarks.behaviours:count',
                }
            },
        },
    }


def unbroken_stream(rate: int) -> dict[str, Any]:
    """Return two nodes: `rate` messages a second from one to the other, which notes the gaps."""
    numbers = {'type': 'std_msgs/msg/Int64', 'qos': rate}
    behaviours = 'benchmarks.behaviours'
    return {
        'source': {
            'state': {'sent': 0},
            'publishers': {'numbers': numbers},
            'timers': {
                'send': {
                    'rate': rate,
                    'behaviour': f'{behaviours}:send_next',
                    'publish': 'numbers',
                }
            },
        },
        'sink': {
            'state': {'number': 0, 'lost': 0, 'came': 0.0, 'gaps': {}},
            'on_stop': f'{behaviours}:tell_gaps',
            'subscriptions': {
                'numbers': {**numbers, 'behaviour': f'{behaviours}:note_gap'},
            },
        },
    }
