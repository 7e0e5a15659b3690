import enum

from action_msgs.msg import GoalStatus
from sensor_msgs.msg import BatteryState as BS
from sensor_msgs.msg import JoyFeedback
from shape_msgs.msg import SolidPrimitive
from visualization_msgs.msg import Marker

Status = enum.IntEnum('Status', {n.removeprefix('STATUS_'): getattr(GoalStatus, n) for n in (
    'STATUS_UNKNOWN', 'STATUS_ACCEPTED', 'STATUS_EXECUTING', 'STATUS_CANCELING', 'STATUS_SUCCEEDED', 'STATUS_CANCELED', 'STATUS_ABORTED')})


class Shapes:
    box, sphere = SolidPrimitive.BOX, SolidPrimitive.SPHERE
    size = {box: 3, sphere: 1}


def status(node):
    msg = GoalStatus()
    order = list(Status)
    step = node.own_state.setdefault('step', iter(order * 50))
    msg.status = next(step)
    return msg


def on_status(node, msg):
    name = Status(msg.status).name
    if msg.status in (msg.STATUS_SUCCEEDED, GoalStatus.STATUS_ABORTED):
        return name.title()
    return {'data': name}


def everything(node):
    battery = BS(power_supply_status=BS.POWER_SUPPLY_STATUS_FULL)
    battery.power_supply_health = battery.POWER_SUPPLY_HEALTH_GOOD
    battery.power_supply_technology = type(battery).POWER_SUPPLY_TECHNOLOGY_LIPO
    node.publish('battery', battery)
    for kind in ('ARROW', 'CUBE', 'TEXT_VIEW_FACING'):
        marker = Marker(type=getattr(Marker, kind), action=Marker.MODIFY, text=kind)
        node.publish('marker', marker)
    node.publish('marker', {'action': Marker.DELETEALL})
    solid = SolidPrimitive(type=Shapes.box)
    solid.dimensions = [0.0] * Shapes.size[solid.type]
    solid.dimensions[SolidPrimitive.BOX_Z] = 2.0
    node.publish('solid', solid)
    node.publish('feedback', {'type': JoyFeedback.TYPE_RUMBLE, 'id': 0, 'intensity': 0.5})
