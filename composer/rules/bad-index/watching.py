def watch(node, message):
    node.logger.info(f'yaw: {message.orientation_covariance[9]}')
