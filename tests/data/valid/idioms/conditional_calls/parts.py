def status(node, request):
    return {'success': True, 'message': f'{node.name} is fine'}


def _lead(node):
    node.publish('order', 'forward')


def _follow(node):
    answer = node.call('status', {})
    node.publish('report', answer.message)


ROLES = {'leader': _lead, 'follower': _follow}


def work(node):
    ROLES[node.parameters.role](node)


def obey(node, message):
    node.state.order = message.data
