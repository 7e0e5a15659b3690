from geometry_msgs.msg import Twist


def drive(n):
    p = n.parameters
    cmd = Twist()
    lin, ang = cmd.linear, cmd.angular
    lin.x = p.speed
    ang.z = p.turn
    this, that = n, cmd
    that.linear.y = 0.0 if this is n else this.nothing
    return that


def integrate(self, msg, scale=0.1):
    s, publish = self.state, self.publish
    s.odometer += scale * msg.linear.x
    (odometer := s.__dict__)['odometer'] *= 1.0
    publish('total', odometer['odometer'])
    trips = s.trips
    trips.append(s.odometer)
    s.last, *_ = trips[-1:]


def trip(ctx):
    state = ctx.state
    context = {'node': ctx, 'state': state}
    if not (trips := context['state'].trips):
        return None
    first, last = trips[0], getattr(context['node'].state, 'last')
    return last - first
