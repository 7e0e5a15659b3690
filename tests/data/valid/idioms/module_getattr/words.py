from functools import partial


def _say(word, node):
    return f'{node.name}: {word}'


def __getattr__(name):
    if name.startswith('say_'):
        return partial(_say, name.removeprefix('say_'))
    raise AttributeError(name)


class on_word:
    """A class may be called, too."""

    def __new__(cls, node, message):
        node.state.words = getattr(node.state, 'words', 0) + len(message.data.split())
