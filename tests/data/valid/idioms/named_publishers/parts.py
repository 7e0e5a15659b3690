import itertools
import math
from string import Template

JOINTS = [f'{end}_{joint}' for end, joint in itertools.product(('front', 'rear'), ('hip', 'knee'))]
TOPIC = 'leg_{index}/state'
LOG = Template('log_$level')


def gait(node):
    t = node.now().nanoseconds * 1e-9
    for offset, joint in enumerate(JOINTS):
        node.publish(joint, math.sin(t + offset * math.pi / 2))


def states(node):
    publish = node.publish
    for index in range(node.parameters.legs):
        publish(TOPIC.format(index=index), ('up', 'down')[index % 2])


def logs(node):
    for level in 'info', 'debug':
        getattr(node.logger, level)(f'a line at {level}', throttle_duration_sec=1.0)
        node.publish(LOG.substitute(level=level), '%s: %d' % (level, len(JOINTS)))
