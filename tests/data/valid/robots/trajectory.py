import bisect


class Curve:
    def __init__(self, points):
        self.times = [to_seconds(point.time_from_start) for point in points]
        self.positions = [list(point.positions) for point in points]

    def at(self, time):
        index = bisect.bisect_right(self.times, time)
        if index == 0:
            return self.positions[0]
        if index == len(self.times):
            return self.positions[-1]
        begin, end = self.times[index - 1], self.times[index]
        share = (time - begin) / (end - begin)
        pairs = zip(self.positions[index - 1], self.positions[index], strict=True)
        return [a + (b - a) * share for a, b in pairs]

    @property
    def length(self):
        return self.times[-1]


def to_seconds(duration):
    return duration.sec + duration.nanosec * 1e-9


def load(node, message):
    if list(message.joint_names) != list(node.parameters.joints):
        node.logger.error(f'expected {node.parameters.joints}, got {message.joint_names}')
        return
    node.state.curve = Curve(message.points)
    node.state.time = 0.0
    node.state.paused = False


def play(node):
    curve = getattr(node.state, 'curve', None)
    if curve is None or node.state.paused:
        return None
    positions = curve.at(node.state.time)
    node.state.time += 0.02 * node.parameters.speed
    if node.state.time > curve.length:
        node.state.curve = None
    return {
        'header': {'stamp': node.now()},
        'name': node.parameters.joints,
        'position': positions,
    }


def pause(node, request):
    node.state.paused = request.data
    return {'success': True}
