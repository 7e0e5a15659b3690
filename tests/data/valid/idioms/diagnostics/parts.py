import random

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

OK, WARN, ERROR, STALE = (getattr(DiagnosticStatus, n) for n in ('OK', 'WARN', 'ERROR', 'STALE'))
TEXT = {OK: 'fine', WARN: 'warm', ERROR: 'hot', STALE: 'silent'}


def check(node, name, warn, error):
    temperature = random.uniform(20, 90)
    level = ERROR if temperature >= error else WARN if temperature >= warn else OK
    return DiagnosticStatus(
        level=level, name=f'{node.name}: {name}', message=TEXT[level],
        values=[KeyValue(key='temperature', value=f'{temperature:.1f}')],
    )


def collect(node, status):
    known = vars(node.state).setdefault('known', {})
    known[status.name] = status, node.now()


def _level(status):
    return int.from_bytes(status.level, 'little')


def aggregate(node):
    known = getattr(node.state, 'known', {})
    if not known:
        return
    now = node.now()
    fresh = [s if (now - at).nanoseconds < 2e9 else _stale(s) for s, at in known.values()]
    worst = max(fresh, key=_level)
    node.publish('toplevel', {'level': worst.level, 'name': 'toplevel_state', 'message': worst.message})
    return {'header': {'stamp': now.to_msg()}, 'status': [*fresh, *_summaries(fresh)]}


def _stale(status):
    status.level, status.message = STALE, TEXT[STALE]
    return status


def _summaries(statuses):
    for level in sorted({s.level for s in statuses}):
        members = [s for s in statuses if s.level == level]
        yield {'level': level, 'name': f'/{TEXT[level]}', 'values': [{'key': m.name, 'value': m.message} for m in members]}


def self_test(node, request):
    statuses = [s for s, _ in getattr(node.state, 'known', {}).values()]
    passed = all(s.level == OK for s in statuses)
    return {'id': node.name, 'passed': b'\x01' if passed else b'\x00', 'status': statuses}


def test(node):
    result = node.call('self_test', {})
    node.logger.info(f'{result.id}: {result.passed == bytes([1])}, {len(result.status)} statuses')
