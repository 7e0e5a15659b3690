import math as _math

__all__ = ('LINKS', 'forward', 'wave')

LINKS = {'shoulder': 0.4, 'elbow': 0.3, 'wrist': 0.1}


def forward(angles):
    total = x = y = 0.0
    for name, length in LINKS.items():
        total += angles.get(name, 0.0)
        x, y = x + length * _math.cos(total), y + length * _math.sin(total)
    return x, y


def wave(t, index, amplitude):
    return amplitude * _math.sin(t + index)
