import rcl_interfaces.srv as srv
from rcl_interfaces.msg import ListParametersResult, Parameter, ParameterDescriptor, ParameterType, ParameterValue

KINDS = {
    bool: ('bool_value', ParameterType.PARAMETER_BOOL), int: ('integer_value', ParameterType.PARAMETER_INTEGER),
    float: ('double_value', ParameterType.PARAMETER_DOUBLE), str: ('string_value', ParameterType.PARAMETER_STRING),
}


def pack(value):
    field, kind = KINDS[type(value)]
    return ParameterValue(**{'type': kind, field: value})


def unpack(msg):
    for field, kind in KINDS.values():
        if msg.type == kind:
            return getattr(msg, field)


def set_values(node, request):
    response = srv.SetParametersAtomically.Response()
    for p in request.parameters:
        node.state.store[p.name] = unpack(p.value)
    response.result.successful = True
    return response


def get_values(node, request):
    answer = getattr(srv, 'GetParameters').Response()
    answer.values = [pack(node.state.store[n]) for n in request.names if n in node.state.store]
    return answer


def get_types(node, request):
    return [KINDS[type(node.state.store[n])][1] if n in node.state.store else ParameterType.PARAMETER_NOT_SET for n in request.names]


def list_values(node, request):
    names = sorted(n for n in node.state.store if not request.prefixes or n.startswith(tuple(request.prefixes)))
    return ListParametersResult(names=names, prefixes=list({n.rpartition('.')[0] for n in names} - {''}))


def describe(node, request):
    return {'descriptors': [ParameterDescriptor(name=n) for n in request.names]}


def session(node):
    values = {'a.x': 1, 'a.y': 2.5, 'b': 'text', 'c': True}
    node.call('set', {'parameters': [Parameter(name=k, value=pack(v)) for k, v in values.items()]})
    yield
    listed = node.call('list', {'prefixes': ['a.']}).result
    got = node.call('get', {'names': listed.names}).values
    node.logger.info(str({n: unpack(v) for n, v in zip(listed.names, got)}))
    yield
    types = node.call('types', ['b', 'zz']).types
    descriptors = node.call('describe', srv.DescribeParameters.Request(names=['b'])).descriptors
    node.logger.info(f'{list(types)} {descriptors[0].name}')
