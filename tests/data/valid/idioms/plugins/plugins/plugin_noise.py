from random import gauss

import plugins


@plugins.register
class Noise:
    def __init__(self, node):
        self.sigma = 0.1

    def __call__(self):
        value = gauss(0, self.sigma)
        return value if value > 0 else None
