from operator import itemgetter

from rclpy.exceptions import ParameterNotDeclaredException


class Side:
    """The parameters of one side, by attribute."""

    def __init__(self, parameters, name):
        self.__dict__.update(_parameters=parameters, _name=name)

    def __getattr__(self, key):
        return self._parameters[f'{self._name}.{key}']


def drive(node):
    for name in node.parameters.sides:
        side = Side(node.parameters, name)
        sign = -1 if side.invert else 1
        node.publish(name, sign * (0.5 + side.offset))


def speed_range(node):
    p = node.parameters
    low, high = map(p.__getitem__, ('min_speed', 'max_speed'))
    assert (low, high) == itemgetter('min_speed', 'max_speed')(p)
    flags = [k for k, v in p.items() if isinstance(v, bool) and v]
    return f'{low}..{high} {len(p)} {flags}'


def optional(node):
    try:
        extra = node.ros.get_parameter('undeclared').value
    except ParameterNotDeclaredException:
        extra = None
    if 'also_undeclared' in node.parameters:
        extra = node.parameters['also_undeclared']
    if node.ros.has_parameter('third'):
        extra = node.ros.get_parameter('third').value
    if getattr(node.parameters, 'log_speed'):
        node.logger.info(f'{extra}')


def check(node, changes):
    if {'min_speed', 'max_speed'} & changes.keys():
        low, high = (changes.get(f'{m}_speed', node.parameters[f'{m}_speed']) for m in ('min', 'max'))
        if low > high:
            return 'min_speed is above max_speed'


def turn(node):
    for i, side in enumerate(node.parameters.sides * 2):
        node.set_parameters(node.name, {f'{side}.{key}': value for key, value in (('offset', i / 10), ('invert', bool(i % 2)))})
        yield
    node.set_parameters(node.name, dict.fromkeys([f'{m}_speed' for m in ('max', 'min')], 0.0))
