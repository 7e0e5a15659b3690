import math

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sensor_msgs.msg import BatteryState


def _constants(cls, prefix):
    """Names of the constants of a message by value."""
    return {getattr(cls, n): n[len(prefix):].lower() for n in dir(type(cls)) + dir(cls) if n.startswith(prefix)}


STATUS = _constants(BatteryState, 'POWER_SUPPLY_STATUS_')
HEALTH = {
    BatteryState.POWER_SUPPLY_HEALTH_GOOD: DiagnosticStatus.OK,
    BatteryState.POWER_SUPPLY_HEALTH_COLD: DiagnosticStatus.WARN,
    BatteryState.POWER_SUPPLY_HEALTH_OVERHEAT: DiagnosticStatus.ERROR,
}


def sample(node):
    n = node.parameters.cells
    node.own_state['charge'] = charge = max(node.own_state.get('charge', 1.0) - 0.01, 0.0)
    msg = BatteryState()
    msg.header.stamp = node.now().to_msg()
    msg.voltage = n * (3.0 + 1.2 * charge)
    msg.temperature = math.nan
    msg.current = -1.5
    msg.charge = charge * node.parameters.capacity_ah
    msg.capacity = msg.design_capacity = node.parameters.capacity_ah
    msg.percentage = charge
    msg.power_supply_status = (
        BatteryState.POWER_SUPPLY_STATUS_FULL if charge > 0.95 else BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    )
    msg.power_supply_health = BatteryState.POWER_SUPPLY_HEALTH_GOOD
    msg.power_supply_technology = BatteryState.POWER_SUPPLY_TECHNOLOGY_LION
    msg.present = True
    msg.cell_voltage = np.full(n, msg.voltage / n, dtype=np.float32)
    msg.location, msg.serial_number = 'slot_a', f'{0xBEEF:08x}'
    return msg


def watch(node, msg):
    node.state.battery = msg
    if msg.power_supply_status != node.state.last_status:
        node.state.last_status = msg.power_supply_status
        node.logger.info(f'battery is {STATUS[msg.power_supply_status]}')
    status = DiagnosticStatus(
        level=HEALTH.get(msg.power_supply_health, DiagnosticStatus.STALE),
        name='battery', hardware_id=msg.serial_number,
        values=[KeyValue(key=f, value=str(getattr(msg, f))) for f in ('voltage', 'current', 'percentage')],
    )
    array = DiagnosticArray(status=[status])
    array.header.stamp = msg.header.stamp
    node.publish('diagnostics', array)
    node.publish('low', bool(msg.percentage < 0.2))


def report(node):
    battery = getattr(node.state, 'battery', None)
    return battery and f'{battery.percentage:.0%} {STATUS.get(battery.power_supply_status, "?")}'
