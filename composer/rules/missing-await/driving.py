async def measure(node):
    node.publish('speed', 1.0)


async def drive(node):
    measure(node)
