from geometry_msgs.msg import Twist

TRANSITIONS = {}


def state(name, timeout=None, then=None):
    """Register a state of the machine."""
    def register(function):
        TRANSITIONS[name] = {'run': function, 'timeout': timeout, 'then': then}
        return function
    return register


@state('forward')
def _forward(node, cmd):
    cmd.linear.x = 0.3
    if node.state.bumped:
        return 'backward'


@state('backward', timeout=0.2, then='turn')
def _backward(node, cmd):
    cmd.linear.x = -0.1


@state('turn', timeout=0.3, then='forward')
def _turn(node, cmd):
    cmd.angular.z = 0.6
    node.state.bumped = False


def _enter(node, name):
    node.state.current, node.state.entered = name, node.now().nanoseconds / 1e9
    node.publish('mode', name)


def step(node):
    cmd = Twist()
    entry = TRANSITIONS[node.state.current]
    follow = entry['run'](node, cmd)
    if entry['timeout'] is not None and node.now().nanoseconds / 1e9 - node.state.entered > entry['timeout']:
        follow = entry['then']
    if follow:
        _enter(node, follow)
    return cmd


def on_bumper(node, msg):
    node.state.bumped |= msg.data


def bump(node):
    count = node.own_state['n'] = node.own_state.get('n', 0) + 1
    return count % 3 == 0
