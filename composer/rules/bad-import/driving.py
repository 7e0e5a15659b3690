from std_msgs.msg import Flaot64


def drive(node):
    node.publish('speed', Flaot64(data=1.0))
