"""Another participant in a system's ROS domain: it sees the graph, and talks to the system."""

from collections import defaultdict
from contextlib import suppress

import rclpy
from rclpy.action import ActionClient
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import NodeNameNonExistentError
from rclpy.qos import QoSDurabilityPolicy, QoSLivelinessPolicy, QoSProfile

from composer.interfaces.classes import import_interface
from tests.running import DEADLINE_SEC

_NAME = 'observer'
# Whatever a subscription requests, a publisher that offers this matches it.
_OFFERED = QoSProfile(
    depth=10,
    durability=QoSDurabilityPolicy.TRANSIENT_LOCAL,
    deadline=Duration(seconds=1),
    liveliness=QoSLivelinessPolicy.MANUAL_BY_TOPIC,
    liveliness_lease_duration=Duration(seconds=5),
)


class Observer:
    """A plain node in a context of its own."""

    def __init__(self, domain_id):
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=domain_id)
        self.node = rclpy.create_node(
            _NAME,
            context=self._context,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[rclpy.Parameter('start_type_description_service', value=False)],
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._publishers = {}
        self._clients = {}

    def publish(self, topic, type_name, **fields):
        """Publish a message on a topic."""
        key = topic, type_name
        message_class = import_interface(type_name)
        if key not in self._publishers:
            self._publishers[key] = self.node.create_publisher(message_class, topic, _OFFERED)
        self._publishers[key].publish(message_class(**fields))

    def count_subscriptions(self, topic, type_name):
        """Return how many subscriptions get what it publishes on a topic."""
        return self._publishers[topic, type_name].get_subscription_count()

    def begin_call(self, service, type_name):
        """Call a service; return the future of its response."""
        key = service, type_name
        if key not in self._clients:
            self._clients[key] = self.node.create_client(import_interface(type_name), service)
        client = self._clients[key]
        assert client.wait_for_service(DEADLINE_SEC), service
        return client.call_async(client.srv_type.Request())

    def send_goal(self, action, type_name, **fields):
        """Send a goal; return the future of its result."""
        key = action, type_name
        if key not in self._clients:
            action_class = import_interface(type_name)
            self._clients[key] = ActionClient(self.node, action_class, action)
        client = self._clients[key]
        assert client.wait_for_server(DEADLINE_SEC), action
        goal = client._action_type.Goal(**fields)
        return self.wait(client.send_goal_async(goal)).get_result_async()

    def wait(self, future):
        """Return what a future gives."""
        self._executor.spin_until_future_complete(future, DEADLINE_SEC)
        assert future.done()
        return future.result()

    def close(self):
        for client in self._clients.values():
            client.destroy()
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()
        self._context.destroy()


def see_graph(node):
    """Return what a node sees of the others, as data that is the same in any run, and the GIDs.

    The GIDs are those of publishers and subscriptions, by their node, kind and topic.
    """
    seen, gids = {}, defaultdict(set)
    for name, namespace in node.get_node_names_and_namespaces():
        if _is_of_system(name):
            with suppress(NodeNameNonExistentError):
                seen[f'{namespace.rstrip("/")}/{name}'] = {
                    'services': sorted(node.get_service_names_and_types_by_node(name, namespace)),
                    'clients': sorted(node.get_client_names_and_types_by_node(name, namespace)),
                }
    for topic, _ in node.get_topic_names_and_types():
        for kind in ('publishers', 'subscriptions'):
            for end in getattr(node, f'get_{kind}_info_by_topic')(topic):
                if _is_of_system(end.node_name):
                    owner = f'{end.node_namespace.rstrip("/")}/{end.node_name}'
                    qos = str(end.qos_profile.get_c_qos_profile().to_dict())
                    ends = seen.setdefault(owner, {}).setdefault((kind, topic), [])
                    ends.append((end.topic_type, str(end.topic_type_hash), qos))
                    ends.sort()
                    gids[owner, kind, topic].add(bytes(end.endpoint_gid))
    # Each node has some ends. Of one whose process has ended, rmw may keep the name for ever: what
    # it said of its nodes last may be taken after it has gone.
    return {name: ends for name, ends in seen.items() if any(ends.values())}, gids


def _is_of_system(node_name):
    return node_name != _NAME and not node_name.startswith('_')
