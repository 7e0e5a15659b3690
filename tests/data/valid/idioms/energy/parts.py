import math

from rcl_interfaces.msg import Log
from sensor_msgs.msg import BatteryState


def current(node):
    return 1 + math.sin(node.now().nanoseconds / 1e9)


def integrate(node, msg):
    now = node.now()
    if 'last' in vars(node.state):
        hours = (now - node.state.last).nanoseconds / 3.6e12
        node.state.used = getattr(node.state, 'used', 0) + msg.data * hours
    node.state.last = now
    if hasattr(node.state, 'used'):
        return 1 - node.state.used / node.parameters.capacity


def cells(node):
    n = node.parameters.cells
    voltages = [3.1 + 0.5 * (i / n) for i in range(n)]
    return BatteryState(voltage=sum(voltages), cell_voltage=voltages, present=n > 0, percentage=math.nan, current=math.nan)


def guard(node, battery: BatteryState):
    unknown = [f for f, kind in battery.get_fields_and_field_types().items() if kind == 'float' and math.isnan(getattr(battery, f))]
    low = [i for i, v in enumerate(battery.cell_voltage) if v < node.parameters.cutoff]
    level = Log.WARN if low else Log.INFO
    node.publish('log', {'level': level, 'name': node.name, 'msg': f'unknown: {unknown}', 'stamp': node.now()})
    return f'cells {low} are low' if low else None
