"""Plain rclpy servers and clients of the shipped systems: `external_peers.py serve` or `ask CALLS`.

A server says `ready` and serves until its standard input closes; a client calls the functions of a
JSON list with their arguments, prints their results as JSON and ends. Both have their types from
packages that this process provides for itself.
"""

import json
import sys
import threading
import time
from itertools import count
from pathlib import Path

import rclpy
from rclpy.action import ActionClient, ActionServer, GoalResponse
from rclpy.parameter import Parameter

from composer.interfaces.build.provision import import_packages, provide_packages
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.definitions.packages import load_packages

DEADLINE_SEC = 90.0
FOLDER = Path(__file__).resolve().parent.parent / 'interfaces'
PACKAGES = ('example_interfaces', 'action_tutorials_interfaces')

folders = {name: FOLDER / name for name in PACKAGES}
import_packages(provide_packages(load_packages(folders, InterfaceCatalogue()), print))

from action_msgs.msg import GoalInfo  # noqa: E402
from action_msgs.srv import CancelGoal  # noqa: E402
from action_tutorials_interfaces.action import Fibonacci  # noqa: E402
from example_interfaces.srv import AddTwoInts  # noqa: E402
from rcl_interfaces.srv import SetParameters  # noqa: E402
from unique_identifier_msgs.msg import UUID  # noqa: E402


def finish(future):
    rclpy.spin_until_future_complete(node, future, timeout_sec=DEADLINE_SEC)
    if not future.done():
        sys.exit('nothing came')
    return future.result()


def call(service_class, name, **fields):
    client = node.create_client(service_class, name)
    if not client.wait_for_service(DEADLINE_SEC):
        sys.exit(f'there is no service {name}')
    return finish(client.call_async(service_class.Request(**fields)))


def meet_action_server(name):
    """Return when the server of an action has found all ends that the node has by now.

    They are found in the order in which they were made; the last of them is made here.
    """
    nobody = GoalInfo(goal_id=UUID(uuid=[1] * 16))
    call(CancelGoal, f'{name}/_action/cancel_goal', goal_info=nobody)


def add(request, response):
    response.sum = request.a + request.b
    return response


def calculate(request, response):
    if node.get_parameter('operation').value == 'subtract':
        request.b = -request.b
    return add(request, response)


def compute(goal):
    sequence = [0, 1]
    for _ in range(1, goal.request.order):
        sequence.append(sequence[-1] + sequence[-2])
        goal.publish_feedback(Fibonacci.Feedback(partial_sequence=sequence))
    goal.succeed()
    return Fibonacci.Result(sequence=sequence)


def serve():
    """Serve sums, and sequences to the first who asks."""
    goals = count()

    def decide(_goal):
        # ROS drops what goes to an end that is not found yet; a client's last one is this.
        while not node.count_subscribers('fibonacci/_action/status'):
            time.sleep(0.01)
        return GoalResponse.REJECT if next(goals) else GoalResponse.ACCEPT

    node.declare_parameter('operation', 'add')
    node.create_service(AddTwoInts, 'add_two_ints', add)
    node.create_service(AddTwoInts, 'calculate', calculate)
    ActionServer(node, Fibonacci, 'fibonacci', compute, goal_callback=decide)
    sys.stdout.write('ready\n')
    sys.stdout.flush()
    threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    sys.stdin.read()


def ask_for_sum(service, a, b):
    return call(AddTwoInts, service, a=a, b=b).sum


def set_operation(operation):
    change = Parameter('operation', value=operation).to_parameter_msg()
    response = call(SetParameters, 'calculator_server/set_parameters', parameters=[change])
    return response.results[0].successful, response.results[0].reason


def send_goal(order, *options):
    """Send a goal, cancel it at its first feedback if so wanted."""
    client = ActionClient(node, Fibonacci, 'fibonacci')
    if not client.wait_for_server(DEADLINE_SEC):
        sys.exit('there is no action fibonacci')
    meet_action_server('fibonacci')
    feedback = []

    def hear(message):
        feedback.append(list(message.feedback.partial_sequence))

    goal = finish(client.send_goal_async(Fibonacci.Goal(order=order), feedback_callback=hear))
    accepted = goal.accepted
    if 'cancel' in options:
        while not feedback:
            rclpy.spin_once(node, timeout_sec=1.0)
        finish(goal.cancel_goal_async())
    outcome = finish(goal.get_result_async())
    return {
        'accepted': accepted,
        'feedback': feedback,
        'status': outcome.status,
        'sequence': list(outcome.result.sequence),
    }


CLIENTS = {'ask_for_sum': ask_for_sum, 'set_operation': set_operation, 'send_goal': send_goal}

if __name__ == '__main__':
    role, *calls = sys.argv[1:]
    rclpy.init()
    node = rclpy.create_node('calculator_server' if role == 'serve' else 'external_peer')
    if role == 'serve':
        serve()
    else:
        results = [CLIENTS[name](*arguments) for name, *arguments in json.loads(*calls)]
        sys.stdout.write(f'result {json.dumps(results)}\n')
