from rclpy.parameter import Parameter, parameter_value_to_python

RULES = {
    'gains': lambda v: None if len(v) == 3 else 'three gains are needed',
    'rate': lambda v: None if v != 13 else 'not 13',
}


def validate(node, changes):
    problems = (rule(changes[name]) for name, rule in RULES.items() if name in changes)
    return next(filter(None, problems), None)


def cycle(node):
    values = ({'mode': 'manual', 'rate': 7}, {'mode': 'auto'}, {'gains': [0.5] * 3, 'label': 'late'}, {'blob': [1, 2]})
    for value in values:
        node.set_parameters('tuner', value)
        yield
    results = node.ros.set_parameters([Parameter('enabled', Parameter.Type.BOOL, False), Parameter('rate', value=13)])
    node.logger.info(', '.join(str(r.successful) + r.reason for r in results))


def dump(node):
    p = node.parameters
    names = ('rate', 'mode', 'gains', 'enabled', 'label')
    text = ' '.join(f'{n}={getattr(p, n)}' for n in names if n in p and p[n] is not None)
    blob = p.get('blob') or []
    described = node.ros.describe_parameter('rate')
    low = described.integer_range[0].from_value
    raw = node.ros.get_parameter('mode').get_parameter_value()
    return f'{text} {sum(blob)} {low} {parameter_value_to_python(raw)}'


def reach(node):
    found = node.get_parameters('tuner', ['rate', 'mode'])
    node.logger.info('{rate} {mode}'.format(**found))
    node.set_parameters('tuner', {'rate': 1 + found['rate'] % 10})
