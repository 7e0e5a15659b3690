"""What behaviours call."""


def warn(node, limit):
    node.logger.warning(f'{limit}', throttle_duration_sec=1.0)
    node.own_states.clear()  # error
