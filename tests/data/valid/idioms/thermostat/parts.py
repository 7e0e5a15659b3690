from sensor_msgs.msg import RelativeHumidity, Temperature

AMBIENT: float = 15


def physics(node, *, loss, power, ambient=AMBIENT):
    s = node.state
    s.temperature += power * s.heating - loss * (s.temperature - ambient)
    return Temperature(temperature=s.temperature, variance=0.0)


def set_heating(node, msg):
    node.state.heating = msg.data


def regulate(node, msg):
    error = node.parameters.target - msg.temperature
    if abs(error) < node.parameters.hysteresis:
        return
    wanted = error > 0
    if wanted is not (previous := node.own_state.get('heating')):
        node.own_state['heating'] = wanted
        node.logger.info(f'heating {previous} -> {wanted}')
        return wanted


def humidity(node):
    msg = RelativeHumidity()
    msg.relative_humidity = 0.4
    (msg.header.stamp.sec, msg.header.stamp.nanosec) = node.now().seconds_nanoseconds()
    return msg
