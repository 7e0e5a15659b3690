from geometry_msgs.msg import Twist

HORN, STOP = 0, 1


def pressed(message, button):
    return button < len(message.buttons) and message.buttons[button] == 1


async def hear(node, message):
    before = node.own_state.setdefault('buttons', [])
    for button, action in ((HORN, honk), (STOP, stop)):
        was_pressed = button < len(before) and before[button]
        if pressed(message, button) and not was_pressed:
            await action(node)
    node.own_state['buttons'] = list(message.buttons)
    if not pressed(message, node.parameters.deadman):
        return
    factor = node.parameters.scale
    turbo = node.parameters.turbo_button
    if turbo is not None and pressed(message, turbo):
        factor *= 2
    command = Twist()
    command.linear.x = factor * message.axes[1]
    command.angular.z = factor * message.axes[0]
    node.publish('cmd_vel', command)


async def honk(node):
    node.publish('horn', {})


async def stop(node):
    try:
        response = await node.call_async('stop', timeout=0.5)
    except Exception as error:
        node.logger.error(f'cannot stop: {error}')
        return
    if response is not None and not response.success:
        node.logger.warning(response.message)
