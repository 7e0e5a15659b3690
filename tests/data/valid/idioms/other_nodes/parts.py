TEAM = {}


def join(node):
    TEAM[node.name] = node


def think(node):
    return f'I am {node.name}, {TEAM["mouth"].state.said} words so far'


def speak(node, message):
    mouth = TEAM['mouth']
    mouth.publish('speech', message.data + '!' * mouth.parameters.volume)
    mouth.state.said += len(message.data.split())
