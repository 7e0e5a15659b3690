MAXIMUM = 7
values: list
__all__ = ['MAXIMUM']


def __getattr__(name):
    if name == 'LIMIT':
        return MAXIMUM * 2
    raise AttributeError(name)
