import threading

from std_msgs.msg import String


class Talker:
    def __init__(self, node):
        self.count = 0
        self.pub = self.create_publisher(String, 'words', 10)  # error

    def talk(self, node):
        self.count += 1
        self.cuont += 1  # error
        self.get_logger().info('talks')  # error
        node.logger.info('%d', self.count)  # error
        node.logger.info('talks', throttle_duration_sec=1.0)
        print(node.parameters.rate.value)  # error
        print(node.parameters.rate.real)
        if self.count > self.most:  # error
            return str(self.late)
        return self.help_out()

    def help_out(self):
        self.late = 3
        if hasattr(self, 'other'):
            return self.other
        return getattr(self, 'never', '')


def give(talker):
    talker.given = 1


class Sharing:
    """Not all of it is its own."""

    def share(self):
        self.join()


class Worker(Sharing, threading.Thread):
    def __init__(self, node):
        super().__init__()

    def work(self, node):
        self.share()
