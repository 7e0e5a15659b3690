SOURCE = """
def make_{name}(node):
    return {value}


def on_{name}(node, message):
    return message.data * 2
"""

exec(SOURCE.format(name='x', value=1.5))
__all__ = [name for name in dir() if name.endswith('_x')]
