def begin(node):
    node.logger.info(f'{node.parameters.speed} m/s')
