def _get(node, *names):
    return [p.value for p in node.ros.get_parameters(names)]


def total(node):
    return sum(_get(node, 'a', 'b'))


def low(node):
    group = node.ros.get_parameters_by_prefix('filter')
    return group['low'].value + group['high'].value


def echo(node):
    ros = node.ros
    hidden = ros.get_parameter_or('hidden').value
    values = node.get_parameters(node.name, ['echoed'])
    return '{echoed}'.format_map(values) * hidden


def listed(node):
    p = node.parameters
    key = ''.join(reversed('detsil'))
    return float(sum(p[key]))
