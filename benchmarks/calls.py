"""Calls of a service of the same process, one after another."""

import time

import rclpy
from rclpy.task import Future
from std_srvs.srv import SetBool

from benchmarks.executors import start_spinning
from benchmarks.programs import READY, composed, printed_figures
from benchmarks.systems import callers, render_system

# Whether a composed system calls by `node.call_async`, and the time-out of its calls.
COMPOSED = {
    'composer': (False, 5.0),
    'composer_unlimited': (False, None),
    'composer_async': (True, 5.0),
}
_WARM_UP_SEC = 1.0
_SPARE_SEC = 30.0


def measure(side: str, _size: int, seconds: float) -> dict[str, float]:
    """Return calls per second.

    Args:
        side: A row of `COMPOSED`; or the name of an executor that runs rclpy's `call_async`.
    """
    if side in COMPOSED:
        is_async, timeout = COMPOSED[side]
        with composed(render_system(callers(seconds, timeout, is_async=is_async))) as program:
            program.wait_for_line(READY)
            return printed_figures(program, seconds + _SPARE_SEC)
    return _measure_rclpy(side, seconds)


def _measure_rclpy(executor: str, seconds: float) -> dict[str, float]:
    rclpy.init()
    calling, serving = rclpy.create_node('calling'), rclpy.create_node('serving')
    count = 0

    def serve(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = request.data
        return response

    def call_next(_answered: Future | None = None) -> None:
        nonlocal count
        count += 1
        client.call_async(SetBool.Request(data=True)).add_done_callback(call_next)

    serving.create_service(SetBool, 'ask', serve)
    client = calling.create_client(SetBool, 'ask')
    start_spinning(executor, [calling, serving])
    client.wait_for_service()
    call_next()
    time.sleep(_WARM_UP_SEC)
    begin, before = time.monotonic(), count
    time.sleep(seconds)
    return {'rate': (count - before) / (time.monotonic() - begin)}
