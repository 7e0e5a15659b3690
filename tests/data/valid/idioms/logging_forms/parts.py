import logging
from functools import partial

from rcl_interfaces.msg import Log
from rclpy.logging import LoggingSeverity

SEVERITY = {'debug': Log.DEBUG, 'info': Log.INFO}


def greet(node):
    log = node.logger
    log.info('hello')
    log.info(str(log.get_effective_level()))
    if log.is_enabled_for(LoggingSeverity.DEBUG):
        log.debug(f'{expensive()}')


def expensive():
    return sum(range(1000))


def forms(node):
    info = node.logger.info
    info('once', once=True)
    info('at most every second', throttle_duration_sec=1.0)
    info('not at first', skip_first=True, once=True)
    info('not at first, throttled', skip_first=True, throttle_duration_sec=0.5)
    node.logger.debug('%s has %d parameters' % (node.name, len(node.parameters)))
    node.logger.info('{!r}'.format({'a': 1}), throttle_duration_sec=2.0, throttle_time_source_type=node.ros.get_clock())


def dynamic(node):
    for level in node.parameters.levels:
        partial(getattr(node.logger, level), once=True)(f'level {level}') if level == 'info' else node.logger.debug(level)
    node.logger.log('by severity', LoggingSeverity.DEBUG)
    stamp = node.now().to_msg()
    return Log(stamp=stamp, level=SEVERITY['info'], name=node.name, msg='text', file=__file__, function='dynamic', line=1)


def child(node):
    logger = node.own_state.setdefault('logger', node.logger.get_child('sub'))
    logger.debug('from below')
    logging.getLogger(__name__).debug('%s', 'python logging is fine, too')
    node.ros.get_logger().debug('as in rclpy')


def goodbye(node):
    node.logger.info('bye')
