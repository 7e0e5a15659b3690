def hear(node, message):
    before = node.state.temperature
    node.state.temperature = (
        message.temperature if before is None else (0.9 * before + 0.1 * message.temperature)
    )


def control(node):
    wanted = decide(node)
    if wanted is None or wanted == node.state.is_on:
        return
    node.state.is_on = wanted
    node.publish('heater', wanted)
    node.publish('status', 'heating' if wanted else 'idle')


def decide(node):
    match node.parameters.mode:
        case 'off':
            return False
        case 'heat':
            return True
    now = node.state.temperature
    if now is None:
        return None
    if now < node.parameters.target - node.parameters.hysteresis:
        return True
    if now > node.parameters.target + node.parameters.hysteresis:
        return False
    return None


def changed(node, changes):
    if 'target' in changes:
        node.logger.info(f'now to {changes["target"]} degrees')
    control(node)
