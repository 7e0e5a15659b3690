from std_msgs.msg import Float64


def drive(node):
    node.publish('speed', Float64(data=1.0))
