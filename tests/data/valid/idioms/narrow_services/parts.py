from __future__ import annotations

import numpy as np
from test_msgs.srv import Arrays, BasicTypes, Empty

Answer = BasicTypes.Response


def buy(node, request: BasicTypes.Request) -> Answer:
    response = Answer()
    stock = node.state.stock
    if (fruit := request.string_value) not in stock:
        response.string_value = f'no {fruit}'
        return response
    left = stock[fruit] - request.uint8_value
    response.bool_value = left >= 0
    if not response.bool_value:
        return response
    stock[fruit] = response.int32_value = left
    response.float32_value = 0.5 * request.uint8_value
    response.byte_value = bytes([left])
    response.char_value = ord(fruit[0])
    return response


def check(node, request: Arrays.Request):
    response = Arrays.Response()
    response.float64_values = np.sort(request.float64_values)
    response.int32_values = request.int32_values[::-1]
    response.bool_values = [not b for b in request.bool_values]
    response.string_values = list(map(str.upper, request.string_values))
    response.uint8_values[0] = len(response.string_values)
    return response


def noop(node, request: Empty.Request) -> Empty.Response | None:
    return Empty.Response() if request == Empty.Request() else None


def shop(node):
    for fruit, n in (('apple', 2), ('apple', 2), ('plum', 1)):
        answer = node.call('buy', BasicTypes.Request(string_value=fruit, uint8_value=n))
        node.logger.info(f'{fruit}: {answer.bool_value} {answer.int32_value} {answer.string_value}')
        yield
    arrays = node.call('check', {'float64_values': [3, 1, 2], 'int32_values': np.arange(3), 'bool_values': (True, False, True), 'string_values': ['a', 'b', 'c']})
    assert list(arrays.float64_values) == [1.0, 2.0, 3.0] and arrays.string_values == ['A', 'B', 'C']
    node.logger.info(f'{arrays.int32_values.tolist()} {node.call("noop", {})}')
