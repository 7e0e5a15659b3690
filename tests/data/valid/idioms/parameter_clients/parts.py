from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters
from rclpy.parameter import Parameter


def talk(node):
    p = node.parameters
    return ' '.join([p.text] * p.rate)


async def tune(node):
    for text, rate in (('hi', 1), ('bye', 3)):
        wanted = [Parameter('text', value=text), Parameter('rate', Parameter.Type.INTEGER, rate)]
        response = await node.call_async('set', {'parameters': [p.to_parameter_msg() for p in wanted]})
        assert all(r.successful for r in response.results)
        yield
        values = (await node.call_async('get', GetParameters.Request(names=[p.name for p in wanted]))).values
        fields = {ParameterType.PARAMETER_STRING: 'string_value', ParameterType.PARAMETER_INTEGER: 'integer_value'}
        node.logger.info(', '.join(str(getattr(v, fields[v.type])) for v in values))
        yield
