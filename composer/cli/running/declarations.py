"""Declare the commands that ask running systems: see `composer.cli.commands`."""

from __future__ import annotations

from functools import wraps
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

from composer.cli.common.argument_types import NUMBERS_ARE_VALUES, takes_format
from composer.cli.running.top_table import DEFAULT_SORT, SORT_NAMES, View
from composer.errors import ExitCode, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable

_LONGEST_SEC = 60.0
_ANSWER_SEC = 5.0
_TRACE_SEC = 10.0

_timeout = click.option(
    '--timeout',
    'timeout_sec',
    type=click.FloatRange(min=0, min_open=True),
    default=_LONGEST_SEC,
    show_default=True,
    metavar='SEC',
    help='How long to wait for the end of it.',
)


def _takes_name(command: Callable[..., int]) -> Callable[..., int]:
    """Add the name of a system (`name`) to a command."""

    @click.argument('name', metavar='[SYSTEM]', required=False)
    @wraps(command)
    def run(*, name: str | None, **options: object) -> int:
        if name is not None and name.endswith(('.yaml', '.yml')):
            message = f"'{name}' is a file, and a running system is asked by its name"
            raise UsageError(message, help=f"name it: '{Path(name).name.partition('.')[0]}'")
        return command(name, **options)

    return run


@click.command('ps')
@_takes_name
@takes_format()
def ps_command(name: str | None, format_name: str) -> int:
    """List the systems that run on this ROS graph, or SYSTEM alone.

    If there is no such system, or it or one of its parts does not answer, the exit code is 1.
    """
    from composer.cli.running.ps import list_running

    return list_running(name, format_name=format_name)


@click.command('top')
@_takes_name
@click.option('--once', is_flag=True, help='Print the table once.')
@takes_format()
@click.option(
    '--sort',
    type=click.Choice(list(SORT_NAMES)),
    default=DEFAULT_SORT,
    show_default=True,
    help='The column to sort by.',
)
@click.option('--filter', 'text', default='', metavar='TEXT', help='Only rows with this text.')
@click.option(
    '--by',
    type=click.Choice(['entity', 'node']),
    default='entity',
    show_default=True,
    help='What a row is.',
)
def top_command(
    name: str | None,
    format_name: str,
    sort: str,
    text: str,
    by: str,
    *,
    once: bool,
) -> int:
    """Show the health of each entity, or of each node, of SYSTEM.

    Calls in a second, callback times, the share of a processor, messages that wait in the queue;
    and since the start dropped messages, late ticks and errors. SYSTEM is its name; if only one
    runs, it need not be named.
    Where the output is no terminal that can draw, and as JSON, it is printed once.
    """
    view = View(sort=sort, text=text, by=by)
    from composer.cli.running.top import top

    return top(name, view, once=once, format_name=format_name)


@click.command('trace')
@_takes_name
@click.option(
    '--seconds',
    'trace_sec',
    type=click.FloatRange(min=0, min_open=True),
    default=_TRACE_SEC,
    show_default=True,
    metavar='SEC',
    help='How long to look at it.',
)
@click.option(
    '-o',
    '--output',
    type=click.File('w', 'utf-8', lazy=False),
    default='trace.json',
    show_default=True,
    metavar='FILE',
    help='The file to write.',
)
def trace_command(name: str | None, trace_sec: float, output: IO[str]) -> int:
    """Write when callbacks of SYSTEM run.

    The file is a timeline for ui.perfetto.dev or chrome://tracing, of callbacks, waits, calls and
    goals, with arrows from messages to the callbacks that get them, the lengths of queues, dropped
    messages and late timers. A summary is printed.
    """
    from composer.application.timelines import trace

    trace(name, trace_sec, output)
    return ExitCode.DONE


@click.command('reload')
@_takes_name
@_timeout
@click.option(
    '--now',
    'aborts_goals',
    is_flag=True,
    help='Abort goals in flight of actions that go, which it waits for otherwise.',
)
def reload_command(name: str | None, timeout_sec: float, *, aborts_goals: bool) -> int:
    """Let SYSTEM read its files again, and become what they say.

    SYSTEM is its name, that of its file without the ending; if only one runs, it need not be
    named. If the files have errors, it runs on as it was.
    """
    from composer.cli.running.commanding import reload

    return reload(name, timeout_sec, aborts_goals=aborts_goals)


@click.command('restart')
@click.argument('node')
@_timeout
def restart_command(node: str, timeout_sec: float) -> int:
    """Build a node, or start an external process, anew.

    Its entities, parameters and state are as at the start again. NODE is its full name, or what
    follows the last slash of it; or the name of an external process.
    """
    from composer.cli.running.commanding import restart

    return restart(node, timeout_sec, 'restart')


@click.command('stop')
@click.argument('node')
@_timeout
def stop_command(node: str, timeout_sec: float) -> int:
    """Stop a node, while the rest of its system runs.

    It stays stopped, also when the system is reloaded, until 'composer start NODE', or until the
    system itself starts again: 'composer down' stops that. NODE is its full name, or what follows
    the last slash of it.
    """
    from composer.cli.running.commanding import restart

    return restart(node, timeout_sec, 'stop')


@click.command('start')
@click.argument('node')
@_timeout
def start_command(node: str, timeout_sec: float) -> int:
    """Start a node that 'composer stop' has stopped.

    Its entities, parameters and state are as at the start again. NODE is its full name, or what
    follows the last slash of it.
    """
    from composer.cli.running.commanding import restart

    if node.endswith(('.yaml', '.yml')):
        message = f"'{node}' is a file, and no node"
        raise UsageError(message, help=f"'composer up {node}' runs its system")
    return restart(node, timeout_sec, 'start')


@click.command('down')
@_takes_name
@_timeout
def down_command(name: str | None, timeout_sec: float) -> int:
    """Stop SYSTEM, and wait until it has stopped.

    SYSTEM is its name; if only one runs, it need not be named.
    """
    from composer.cli.running.commanding import down

    return down(name, timeout_sec)


@click.command('logs')
@_takes_name
@click.option('--follow', '-f', 'follows', is_flag=True, help='Go on until the system ends.')
def logs_command(name: str | None, *, follows: bool) -> int:
    """Print what SYSTEM on this host has said.

    It must write to a file, as 'composer up --detach' does. Of one that has ended, the last log is
    printed.
    """
    from composer.cli.running.log_files import show_logs

    return show_logs(name, follows=follows)


@click.command('capture')
@click.argument('nodes', nargs=-1, metavar='[NODE]...')
@click.option(
    '-o',
    '--output',
    type=click.Path(path_type=Path, dir_okay=False),
    metavar='FILE',
    help='The file to write. Default: standard output.',
)
@click.option(
    '--timeout',
    'timeout_sec',
    type=click.FloatRange(min=0, min_open=True),
    default=_ANSWER_SEC,
    show_default=True,
    metavar='SEC',
    help='How long nodes may take to say which parameters they have.',
)
def capture_command(nodes: tuple[str, ...], output: Path | None, timeout_sec: float) -> int:
    """Write down what the nodes on this ROS graph have.

    Each NODE, or all nodes, with publishers, subscriptions, services, clients and actions, their
    types and QoS, and with parameters: to paste under `processes:`, so that `composer check`
    knows what they have. NODE is a full name, or what follows the last slash of it. If a node
    does not say its parameters, the exit code is 1.
    """
    from composer.cli.running.capture import capture

    return capture(nodes, output=output, timeout_sec=timeout_sec)


_answer_timeout = click.option(
    '--timeout',
    'timeout_sec',
    type=click.FloatRange(min=0, min_open=True),
    default=_ANSWER_SEC,
    show_default=True,
    metavar='SEC',
    help='How long to look for it, and to wait for its answer.',
)


def _names(kind: str) -> Callable[..., Any]:
    """Add the name of what is on the graph to a command; the shell completes it."""

    def complete(_context: click.Context, _argument: click.Parameter, begun: str) -> list[str]:
        from composer.cli.running.live_values import list_names

        return [each for each in list_names(kind) if each.startswith((begun, f'/{begun}'))]

    return click.argument(kind, shell_complete=complete)


@click.command('echo')
@_names('topic')
@click.argument('field', default='')
@click.option('--once', is_flag=True, help='End with the first message.')
@click.option('--hz', 'tells_rate', is_flag=True, help='Print how many come in a second instead.')
@_answer_timeout
def echo_command(
    topic: str, field: str, timeout_sec: float, *, once: bool, tells_rate: bool
) -> int:
    """Print the messages of TOPIC, or FIELD of each.

    It goes on until it is interrupted. FIELD is a part of the message, as pose.position.x or
    ranges[0]. With --once, the exit code is 1 if no message comes in time.
    """
    from composer.cli.running.live_values import echo

    return echo(topic, field, once=once, tells_rate=tells_rate, timeout_sec=timeout_sec)


@click.command('call')
@_names('service')
@click.argument('payload', default='')
@_answer_timeout
def call_command(service: str, payload: str, timeout_sec: float) -> int:
    """Call SERVICE with PAYLOAD, and print its answer.

    PAYLOAD is YAML as in a scenario: '{a: 1, b: 2}', or the value alone of a request with one
    field. What it leaves out has its default.
    """
    from composer.cli.running.live_values import call

    return call(service, payload, timeout_sec)


@click.command('send-goal')
@_names('action')
@click.argument('payload', default='')
@_answer_timeout
def send_goal_command(action: str, payload: str, timeout_sec: float) -> int:
    """Send a goal to ACTION, and print its result.

    PAYLOAD is YAML, as for 'composer call'. Feedback is printed, too. The result may take as long
    as it likes; Ctrl-C cancels the goal. If it does not succeed, the exit code is 1.
    """
    from composer.cli.running.live_values import send_goal

    return send_goal(action, payload, timeout_sec)


@click.command('set', context_settings=NUMBERS_ARE_VALUES)
@_names('node')
@click.argument('parameter')
@click.argument('value')
@_answer_timeout
def set_command(node: str, parameter: str, value: str, timeout_sec: float) -> int:
    """Set PARAMETER of NODE to VALUE, which is YAML.

    NODE is its full name, or what follows the last slash of it. If the node refuses the value, the
    exit code is 1.
    """
    from composer.cli.running.live_values import set_parameter

    return set_parameter(node, parameter, value, timeout_sec)


COMMANDS = (
    capture_command,
    echo_command,
    call_command,
    send_goal_command,
    set_command,
    ps_command,
    top_command,
    trace_command,
    logs_command,
    reload_command,
    restart_command,
    stop_command,
    start_command,
    down_command,
)
