"""A player with a thread of its own and services, and a recorder that begins anew."""

import threading
import time


class Player:
    """Plays numbers: can be paused, stepped, resumed and made faster."""

    def __init__(self):
        self.changed = threading.Condition()
        self.is_paused, self.steps, self.is_over = True, 0, False

    def begin(self, node):
        threading.Thread(target=self.play, args=[node]).start()

    def end(self, _node):
        with self.changed:
            self.is_over = True
            self.changed.notify_all()

    def play(self, node):
        for number in range(node.parameters.length):
            with self.changed:
                self.changed.wait_for(lambda: self.is_over or self.steps or not self.is_paused)
                if self.is_over:
                    return
                self.steps = max(0, self.steps - 1)
            node.publish('played', number)
            if not self.is_paused:
                time.sleep(0.1 / node.parameters.rate)
        node.logger.info('all is played')

    def pause(self, _node, _request):
        self.is_paused = True
        return {}

    def resume(self, _node, _request):
        with self.changed:
            self.is_paused = False
            self.changed.notify_all()
        return {}

    def step(self, _node, _request):
        with self.changed:
            self.steps += self.is_paused
            self.changed.notify_all()
            return {'success': self.is_paused}


class Recorder:
    """Counts what it hears while it records, each time with a new subscription."""

    def __init__(self):
        self.subscription, self.count = None, 0

    def record(self, node, request):
        if request.data:
            self.subscription = node.create_subscription('std_msgs/msg/Int32', 'played', self.keep)
        else:
            node.destroy(self.subscription)
        return {'success': True, 'message': str(self.count)}

    def keep(self, _node, _message):
        self.count += 1
