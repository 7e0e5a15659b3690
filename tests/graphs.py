"""The graph of a ROS domain, as a plain rclpy node sees it."""

from tests.running import Peer

INFRASTRUCTURE = ('/rosout', '/parameter_events', '/diagnostics')
OWN_PARAMETERS = ('use_sim_time', 'start_type_description_service')


class Graph:
    """What a plain node sees of a domain."""

    def __init__(self, domain_id):
        self._peer = Peer(domain_id)

    def nodes(self):
        names = self._peer.node.get_node_names_and_namespaces()
        return sorted(
            (namespace, name)
            for name, namespace in names
            if name != 'peer' and not name.startswith('_')
        )

    def ends(self):
        """Return all ends of topics whose nodes are known: topic, type, node, and policies."""
        node = self._peer.node
        found = []
        for topic, _ in node.get_topic_names_and_types():
            if topic in INFRASTRUCTURE:
                continue
            for info in (
                *node.get_publishers_info_by_topic(topic),
                *node.get_subscriptions_info_by_topic(topic),
            ):
                # Of hidden nodes, and of such whose names are not found yet.
                if info.node_name.startswith('_'):
                    continue
                profile = info.qos_profile
                policies = (profile.reliability, profile.durability, profile.liveliness)
                durations = (profile.deadline, profile.lifespan)
                found.append(
                    (
                        topic,
                        info.topic_type,
                        f'{info.node_namespace} {info.node_name}',
                        info.endpoint_type.name,
                        *(policy.name for policy in policies),
                        *(duration.nanoseconds for duration in durations),
                    )
                )
        return sorted(found)

    def parameters(self, full_names):
        from rcl_interfaces.srv import GetParameters, ListParameters

        found = {}
        for full_name in full_names:
            listed = self._peer.call(ListParameters, f'{full_name}/list_parameters')
            names = sorted(set(listed.result.names) - set(OWN_PARAMETERS))
            response = self._peer.call(GetParameters, f'{full_name}/get_parameters', names=names)
            found[full_name] = dict(zip(names, map(str, response.values), strict=True))
        return found

    def close(self):
        self._peer.close()
