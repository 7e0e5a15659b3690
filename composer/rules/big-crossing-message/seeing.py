def take(node):
    return {'width': 640, 'height': 480}


def detect(node, image):
    node.logger.info(f'{image.width} columns')
