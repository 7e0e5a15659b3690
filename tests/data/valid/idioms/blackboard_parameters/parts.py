SHARED = ('robot_name', 'wheel_radius', 'frames')


def alive(node):
    node.logger.debug('alive')


def use(node):
    shared = node.get_parameters('parameter_blackboard', list(SHARED))
    return f'{shared["robot_name"]} {shared["wheel_radius"]} {"/".join(shared["frames"])}'
