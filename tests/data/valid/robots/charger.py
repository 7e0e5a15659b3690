import enum
import logging

log = logging.getLogger(__name__)


class Phase(enum.Enum):
    IDLE = 'idle'
    DOCKING = 'docking'
    CHARGING = 'charging'
    FAILED = 'failed'


def battery(node, message):
    if message.percentage == message.percentage:
        node.state.level = message.percentage
    if message.power_supply_status == message.POWER_SUPPLY_STATUS_CHARGING:
        enter(node, Phase.CHARGING)


def enter(node, phase):
    if node.state.phase != phase.value:
        node.logger.info(f'{node.state.phase} -> {phase.value}')
        node.state.phase = phase.value


async def tick(node):
    phase = Phase(node.state.phase)
    if phase is Phase.IDLE and node.state.level < node.parameters.low:
        enter(node, Phase.DOCKING)
        node.state.tries = 0
    elif phase is Phase.DOCKING:
        await dock(node)
    elif phase is Phase.CHARGING and node.state.level > node.parameters.full:
        answer = await node.call_async('connect', False)
        if answer is not None and answer.success:
            enter(node, Phase.IDLE)
    return node.state.phase


async def dock(node):
    node.state.tries += 1
    goal = node.send_goal('dock', {'order': 3})
    result = await goal.result_async()
    if goal.status == 'succeeded' and len(result.sequence) > 0:
        answer = await node.call_async('connect', {'data': True}, timeout=2.0)
        if answer is None:
            log.warning('nobody answers')
            return
        enter(node, Phase.CHARGING if answer.success else Phase.DOCKING)
    elif node.state.tries >= node.parameters.attempts:
        enter(node, Phase.FAILED)
