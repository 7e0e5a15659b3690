RATE_HZ = int('ten')


def start(node):
    return RATE_HZ
