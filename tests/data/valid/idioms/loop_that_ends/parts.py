import random


def serve(node):
    return random.randint(1, 5)


def bounce(node, ball):
    ball.data -= ball.data > 0
    return ball


def hit(node, ball):
    return ball if ball.data else None
