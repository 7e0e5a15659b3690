import asyncio


async def blink(node):
    node.logger.info('on')
    await asyncio.sleep(0.5)
    node.logger.info('off')
