def drive(node):
    node.pubish('speed', 1.0)
    node.publish('speed', 2.0)
