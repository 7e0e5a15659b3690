def declare(node):
    if node.name == 'rich':
        node.state.bonus = node.parameters.extra
    if not node.ros.has_parameter('dynamic'):
        node.ros.declare_parameter('dynamic', 3.5)


def _by_name(node):
    match node.name:
        case 'rich':
            return node.parameters.extra
        case 'poor':
            return 0


def value(node):
    total = node.parameters.gain + _by_name(node)
    if 'extra' in node.parameters:
        total += node.parameters.extra
    if hasattr(node.state, 'bonus'):
        total += node.state.bonus
    total += node.parameters['extra'] if 'extra' in node.parameters else 0
    try:
        total += node.parameters['extra']
    except (KeyError, AttributeError):
        pass
    if 'dynamic' in node.parameters:
        total += node.parameters.dynamic
    return float(total)
