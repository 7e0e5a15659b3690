RATE_HZ = int('10')


def start(node):
    return RATE_HZ
