"""For each key of the schema, values that edits give it, good and bad; `None` removes the key.

The keys are named as `tests.runtime.rewiring.schema_keys` reads them from the schema.
"""

NULL = 'null, which is a value'

_BOOL = [True, False, None]
_STRINGS = ['how it is', 'otherwise', None]
_NAMESPACE = ['/inner', '/outer/most', 'relative', 'no good', None]
_REMAP = [{'far': 'further'}, {'out': '/in', '/ask': '/tell'}, {'a b': 'c'}, None]
_FOREACH = [{'i': [1, 2]}, {'i': [1]}, {'i': [3, 1]}, {'i': []}, {'i': 4}, None]
_WHEN = [True, False, '{{ 1 > 2 }}', 'perhaps', None]
_GROUP = ['reentrant', 'own', '', None]
_ON_ERROR = ['log', 'restart', 'shutdown', 'ignore', None]
_WARN_AFTER = [0.5, 2.0, NULL, 0, None]
_EXTERNAL = [True, '{{ 1 < 2 }}', 'yes', None]
_TYPES = ['std_msgs/msg/String', 'std_msgs/msg/Header', 'nowhere/msg/Wrong', 'String']
_INTROSPECTION = ['metadata', 'contents', 'off', 'all', None]
_OVERRIDES = [True, ['depth', 'deadline'], ['dept'], None]
_EVENT = ['parts:notice', 'parts:notice_later', 'parts:notce', None]
_BY_NAME = {'parameter': 'name', 'format': '/{}/x'}
_TOPIC = ['out', _BY_NAME, 'far', '/away', '~/own', 'bad name', None]
_QOS = [None, 5, 'near', 'sensor_data', 'nearest', {'depth': 7}, {'dept': 1}]
_TRIGGERS = ['std_srvs/srv/Trigger', 'std_srvs/srv/Empty', 'std_srvs/srv/Trager']
_ACTIONS = ['test_msgs/action/Fibonacci', 'test_msgs/action/NestedMessage', 'a/action/B']
_HEARING = ['parts:hear', 'parts:hear_later', 'peer:hear', 'parts:nothing', 'parts.hear', None]
_CONDITION = [
    {'node': 'listener', 'timeout': 4.0},
    {'service': '/ask', 'timeout': 4.5},
    {'process': 'sleeper'},
]
_WAIT_FOR = [*_CONDITION, _CONDITION, {'topic': '/nowhere', 'timeout': 0.1}, [], None]
_ON_EXIT = ['shutdown', 'parts:ended', {'start': 'packaged'}, [{'behaviour': 'parts:ended'}]]
_DELAY = [0.05, 0.1, -1, None]
_FILES = [['parameters.yaml'], ['parameters.yaml', 'others.yaml'], ['absent.yaml'], None]
_COMMAND = [['echo', 'two'], ['echo', '{{ half }}'], ['false'], ['eccho', '1'], [], None]
_TIMEOUT = [9.0, 0, None]
_FILE = ['others.yaml', 'absent.yaml', 3, None]
_KEY = ['talker.ros__parameters.name', 'talker.name', '', None]
_WORKER = ['left', 'right', 'third', '', 'no good', None]
_BEGIN = ['parts:begin', {'behaviour': 'parts:begin', 'with': {'text': 'b'}}]
# Whatever its arguments are.
_SLEEP = ['sh', '-c', 'exec sleep 900']
_TICK = {'period': 0.03, 'behaviour': 'parts:tick'}

_NAMED = ('publisher', 'subscription', 'timer', 'service', 'service_client', 'action')
_NAMED = (*_NAMED, 'action_client', 'parameter')
_CALLED = ('subscription', 'timer', 'service', 'action', 'node', 'defaults')
_SWITCHES = ('parameter_services', 'rosout', 'type_description_service', 'logger_services')
_EVENTS = ('deadline_missed', 'incompatible_qos', 'matched')
_OF_SEVERAL = (
    ((*_NAMED, 'worker', 'node', 'process'), ('foreach',), _FOREACH),
    ((*_NAMED, 'worker', 'node', 'process', 'include'), ('when',), _WHEN),
    (('system', 'argument', 'worker', 'node', 'parameter', 'process'), ('description',), _STRINGS),
    (_CALLED, ('on_error',), _ON_ERROR),
    (_CALLED, ('warn_after',), _WARN_AFTER),
    (('subscription', 'timer', 'service'), ('group',), _GROUP),
    (('publisher', 'subscription'), ('type',), _TYPES),
    (('publisher', 'subscription'), ('topic',), _TOPIC),
    (('publisher', 'subscription'), ('qos',), _QOS),
    (('publisher', 'subscription'), ('qos_overrides',), _OVERRIDES),
    (('publisher', 'subscription'), tuple(f'on_{each}' for each in _EVENTS), _EVENT),
    (('publisher',), ('on_liveliness_lost',), _EVENT),
    (('subscription',), ('on_liveliness_changed', 'on_message_lost'), _EVENT),
    (('publisher', 'subscription', 'service_client', 'action_client'), ('external',), _EXTERNAL),
    (('service', 'service_client'), ('introspection',), _INTROSPECTION),
    (('node', 'defaults'), (*_SWITCHES, 'local_delivery'), _BOOL),
    (('node', 'defaults'), ('namespace',), _NAMESPACE),
    (('node', 'defaults'), ('use_sim_time',), [True, None, None]),
    (('node', 'process'), ('parameter_files',), _FILES),
    (('node', 'process'), ('delay',), _DELAY),
    (('node', 'process'), ('wait_for',), _WAIT_FOR),
    (('node', 'process'), ('remap',), _REMAP),
)

VALUES = {
    **{
        f'{owner}.{key}': values
        for owners, keys, values in _OF_SEVERAL
        for owner in owners
        for key in keys
    },
    'system.version': [1, 2, '1', None],
    'system.args': [{'speed': 2.0, 'where': 'far'}, {'speed': 3.0}, None],
    'system.vars': [{'half': '{{ speed * 2 }}'}, {'half': '{{ half }}'}, {}, None],
    'argument.type': ['double', 'string', 'float', None],
    'argument.default': [1.5, 99.0, 'fast', None],
    **{
        f'{thing}.{key}': values
        for thing in ('argument', 'parameter', 'start_value')
        for key, values in (
            ('command', _COMMAND),
            ('timeout', _TIMEOUT),
            ('file', _FILE),
            ('key', _KEY),
        )
    },
    'argument.choices': [[1.0, 1.5], [1.0, 2.0, 99.0], [], None],
    'system.check': [{'other': {}}, {'other': {'args': {'speed': 2.0}}}, {'a': 1}, None],
    'combination.args': [{'speed': 2.0}, {'sped': 2.0}, None],
    'combination.layers': [['layer.yaml'], ['absent.yaml'], None],
    'combination.set': [{'nodes.talker.log_level': 'warn'}, {'nodes.x.y': 1}, None],
    'system.interfaces': [{'std_srvs': 'absent'}, {'Bad Name': 'x'}, {}, None],
    'system.qos': [{'near': {'depth': 4}}, {'far': {'depth': 1}}, {'near': {'depth': 3}}, None],
    'qos_profile.profile': ['sensor_data', 'near', 'nowhere', None],
    'qos_profile.history': ['keep_last', 'keep_all', 'keep_some', None],
    'qos_profile.depth': [1, 20, 0, {'parameter': 'limit'}, None],
    'qos_profile.reliability': ['reliable', 'best_effort', 'maybe', None],
    'qos_profile.durability': ['volatile', 'transient_local', 'for_ever', None],
    'qos_profile.deadline': [2.0, 'infinite', -1.0, None],
    'qos_profile.lifespan': [5.0, 'infinite', 'short', None],
    'qos_profile.liveliness': ['automatic', 'manual_by_topic', 'lively', None],
    'qos_profile.liveliness_lease_duration': [10.0, 'infinite', 0, None],
    'system.defaults': [{}, {'log_level': 'warn'}, {'colour': 'red'}, None],
    'defaults.log_level': ['debug', 'warn', 'loud', None],
    'defaults.qos': _QOS,
    **dict.fromkeys(('node.worker', 'include.worker', 'defaults.worker'), _WORKER),
    'system.workers': [{'left': {'threads': 3}, 'third': {}}, {}, {'left': 5}, None],
    'worker.cpus': [[0], [1], [0, 1], [1023], [], None],
    'worker.nice': [1, 3, 20, None],
    'worker.threads': [1, 4, 0, None],
    'worker.environment': [{'SIDE': 'a'}, {'SIDE': 'b'}, {'NO GOOD': 'b'}, None],
    'worker.restart': [{'when': 'always'}, 'always', {}, None],
    'worker.required': _BOOL,
    'worker.log_level': ['debug', 'error', 'loud', None],
    'system.max_nodes': [50, 3, 0, None],
    'system.include': [{}, {'one': {'file': 'part.yaml'}}, {'one': 'part.yaml'}, None],
    'include.file': ['part.yaml', 'absent.yaml', None],
    'include.namespace': ['/wheels/{{ side }}', '/wheels', None],
    'include.args': [{'size': 3}, {'size': 'big'}, {'sise': 3}, None],
    'include.remap': [{'turns': 'rounds'}, {'turns': '/all'}, {'a': 1}, None],
    'include.foreach': [{'side': ['left']}, {'side': ['left', 'right']}, {'side': 1}, None],
    'system.executor': [{}, {'threads': 9}, {'thread': 9}, None],
    'executor.threads': [8, 0, None],
    'executor.shutdown_timeout': [4.0, 6.0, -1, None],
    'system.environment': [{}, {'GAME': 'b'}, {'NO GOOD': 'b'}, None],
    'system.diagnostics': [True, False, {'period': 0.5}, 'often', None],
    'diagnostics.period': [0.3, 2.0, 0, None],
    'system.nodes': [{}, None],
    'condition.topic': ['/out', '/far', None],
    'condition.service': ['/ask', None],
    'condition.action': ['/count', None],
    'condition.node': ['listener', 'nobody', None],
    'condition.process': ['sleeper', 'nobody', None],
    'condition.state': ['running', 'active', 'gone', None],
    'condition.timeout': [0.3, 5.0, 0, None],
    'parameter_file.file': _FILE,
    'parameter_file.expressions': [True, False, {'half': 1}, 'perhaps', None],
    'parameter_file.root': ['/inner', '{{ where }}', 'a b', None],
    'node.log_level': ['debug', 'error', 'loud', None],
    'node.parameters': [{'speed': 2.0, 'extra': [1.0, 2.0]}, {'bad name': []}, {}, None],
    'parameter.default': [0.5, 2.0, 20, 'fast', [1, 2, 3], 1000.0, True, None],
    'parameter.type': ['double', 'integer', 'string', 'string_array', 'byte_array', 'real', None],
    'parameter.read_only': [True, False, 'no', None],
    'parameter.minimum': [0, 0.5, 200.0, None],
    'parameter.maximum': [50, 100.0, 0.25, None],
    'parameter.step': [0.5, 1, 0, None],
    'parameter.choices': [['slow', 'fast', 'Bob'], [1.0, 2.0], [5, 7], [], None],
    'node.state': [{'begun': True, 'last': 1}, {'more': [1]}, {'begun': []}, 5, None],
    'node.publishers': [{'out': 'std_msgs/msg/String'}, {'out': 'String'}, {}, None],
    'publisher.local_delivery': _BOOL,
    'node.subscriptions': [
        {'turns': {'type': 'std_msgs/msg/String', 'behaviour': 'parts:hear'}},
        {'turns': 'std_msgs/msg/String'},
        {},
        None,
    ],
    'subscription.raw': [True, False, 'bytes', None],
    'subscription.behaviour': _HEARING,
    'subscription.with': [{'prefix': 'z'}, {'prefix': 'y'}, {'prefx': 'z'}, None],
    'subscription.publish': ['echo', 'nothing', None],
    'subscription.read_only': _BOOL,
    'subscription.while_inactive': ['keep', 'drop', 'hold', None],
    'node.timers': [{'tick': _TICK}, {'tick': {**_TICK, 'with': {'text': 'n'}}}, {}, None],
    **{
        f'{kind}_by_parameter.parameter': ['limit', 'name', 'nothing', None]
        for kind in ('value', 'number', 'text')
    },
    'number_by_parameter.scale': [2, 0.5, 0, None],
    'text_by_parameter.format': ['{}/y', '/{}', 'none', None],
    'timer.period': [0.02, 0.05, 0.08, 100.0, '{{ 1 / 40 }}', -1.0, None],
    'timer.rate': [50, 25.0, 0, {'parameter': 'limit', 'scale': 5}, {'parameter': 'x'}, None],
    'timer.behaviour': [
        *('parts:tick', 'parts:steps', 'parts:few_steps', 'parts:tick_later', 'parts:ticking'),
        *('parts:steps_later', 'peer:tick', 'parts:tock', 'absent:tick', None),
        *('parts:Kept.tick', 'parts:Kept.tick_later', 'parts:Kept.tock', 'parts:Ticking.tick'),
    ],
    'timer.with': [{'text': 'z'}, {'text': 'y'}, {'txt': 'z'}, None],
    'timer.publish': ['out', 'more', 'nothing', None],
    'timer.message': ['bye', {'data': 'bye'}, {'date': 'bye'}, None],
    'timer.clock': ['ros', 'steady', 'system', 'sundial', None],
    'node.services': [
        {'ask': {'type': 'std_srvs/srv/Trigger', 'behaviour': 'parts:answer'}},
        {'ask': {'type': 'std_srvs/srv/Trigger'}},
        {},
        None,
    ],
    'service.type': _TRIGGERS,
    'service.service': ['/ask', '/tell', '~/ask', 'a b', None],
    'service.qos': [{'depth': 7}, {'depth': 0}, None],
    'service.behaviour': ['parts:answer', 'parts:answer_later', 'parts:anwser', None],
    'service.with': [{'text': 'no'}, {'txt': 'no'}, None],
    'service.while_inactive': ['keep', 'drop', 'hold', None],
    'node.service_clients': [{'ask': 'std_srvs/srv/Trigger'}, {'ask': 1}, {}, None],
    'service_client.type': _TRIGGERS,
    'service_client.service': ['/ask', '/tell', None],
    'service_client.qos': [{'depth': 7}, {'depth': 0}, None],
    'node.actions': [
        {'count': {'type': 'test_msgs/action/Fibonacci', 'behaviour': 'parts:count_at_once'}},
        {'count': 1},
        {},
        None,
    ],
    'action.type': _ACTIONS,
    'action.action': ['/count', '/compute', 'a b', None],
    'action.behaviour': ['parts:count', 'parts:count_at_once', 'parts:count_later', 'parts:c'],
    'action.with': [{'first': 4}, {'frist': 4}, None],
    'action.accept': ['parts:accept', 'parts:refuse', None],
    'action.concurrency': ['queue', 'reject', 'preempt', 'parallel', 'wild', None],
    'node.action_clients': [{'count': 'test_msgs/action/Fibonacci'}, {'count': 1}, {}, None],
    'action_client.type': _ACTIONS,
    'action_client.action': ['/count', '/compute', None],
    'action_client.feedback': ['parts:follow', 'parts:folow', None],
    'action_client.result': ['parts:follow', 'parts:folow', None],
    'node.on_start': [*_BEGIN, 'parts:fail_to_begin', 'parts:bgin', None],
    'hook.behaviour': ['parts:begin', 'parts:end', 'parts:decide_later', 'parts:x'],
    'hook.with': [{'text': 'c'}, {'most': 60.0}, {'txt': 'c'}, None],
    'node.on_stop': ['parts:end', *_BEGIN, None],
    **{
        f'node.{key}': ['parts:end', *_BEGIN, None]
        for key in ('on_configure', 'on_activate', 'on_deactivate', 'on_cleanup', 'on_error_state')
    },
    'node.lifecycle': [True, {'start': 'active'}, {'start': 'inactive'}, {'strt': 1}, 'yes', None],
    'lifecycle.start': ['active', 'inactive', 'unconfigured', 'finalized', None],
    'node.bond': [False, 'yes', None],
    'node.before_parameters_set': ['parts:adjust', 'parts:adjst', None],
    'node.after_parameters_set': ['parts:adjust', 'parts:adjst', None],
    'node.allow_undeclared_parameters': _BOOL,
    'node.automatically_declare_parameters_from_overrides': _BOOL,
    'node.on_parameters': [
        *('parts:decide', 'parts:decide_later', 'parts:decde'),
        {'behaviour': 'parts:decide', 'with': {'most': 30.0}},
        None,
    ],
    'system.processes': [{}, {'sleeper': {'command': _SLEEP}}, {'sleeper': []}, None],
    'process.command': [_SLEEP, [*_SLEEP, 'well', 7], ['slepe', '1'], [], None],
    'process.package': ['sleeping', 'waking', None],
    'process.executable': ['sleeper', 'waker', None],
    'process.arguments': [['600'], [700], 'all', None],
    'process.name': ['dreamer', 'a b', None],
    'process.namespace': ['/bed', None],
    'process.parameters': [{'depth': 3}, {'depth': {'a': 1}}, None],
    'process.log_level': ['debug', 'loud', None],
    'process.env': [{'A': 'b'}, {'A': 1, 'B': True}, {'A=': 'b'}, None],
    'process.cwd': ['pack', 'absent', None],
    'process.lifecycle': ['alive', None],
    'process.on_exit': [*_ON_EXIT, [{'start': 'no'}], 3, None],
    'exit_action.start': ['packaged', 'sleeper', 'nobody', None],
    'exit_action.behaviour': ['parts:ended', 'parts:ende', None],
    'exit_action.with': [{'text': 'b'}, {'txt': 'b'}, None],
    'process.restart': [{'when': 'always'}, 'always', {}, None],
    'process_restart.when': ['always', 'never', 'sometimes', None],
    'process_restart.delay': [0.5, -1, None],
    'process_restart.max': [3, -1, None],
    'process.stop': [{'signal': 'SIGTERM'}, 'SIGTERM', None],
    'process_stop.signal': ['SIGTERM', 'SIGKILL', 'SIGNAL', None],
    'process_stop.timeout': [1.5, -1, None],
}
_DECLARED = 'what a process is declared to have changes nothing that runs, as test_plan.py says'
_SOURCES = 'tests/runtime/entities/test_sources.py edits sources'
_APART = 'tests/runtime/external/test_components.py edits containers, which take long to start'
_ELSEWHERE = 'where all runs on one computer, it changes nothing that runs'
_RESTART = 'a change of a package needs a restart'
_NEWER = 'only newer versions of rclpy have it'
# Things of which no edit gives a key a value, and why.
LEFT_OUT_WHOLLY = {
    'interface_package': _RESTART,
    **dict.fromkeys(('container', 'component'), _APART),
    **dict.fromkeys(('host', 'network'), _ELSEWHERE),
    'content_filter': _NEWER,
    'source': _SOURCES,
    **{f'declared_{each}': _DECLARED for each in ('node', 'topic', 'service', 'action')},
}
# Keys of others.
LEFT_OUT = {
    **{
        f'{kind}.{key}': 'what is absent has no health: it has a test of its own'
        for kind in ('publisher', 'subscription')
        for key in ('active', 'made_by')
    },
    **{f'{each}.host': _ELSEWHERE for each in ('node', 'process', 'include', 'worker')},
    **dict.fromkeys(('system.hosts', 'system.network', 'defaults.host'), _ELSEWHERE),
    'subscription.content_filter': _NEWER,
    'system.containers': _APART,
    'node.sources': _SOURCES,
    **{
        f'process.{key}': _DECLARED
        for key in (
            *('publishers', 'subscriptions', 'services', 'service_clients', 'actions'),
            *('action_clients', 'interface', 'nodes'),
        )
    },
    'process.launch': 'it needs a ros2, as tests/processes/test_launch_process.py has one',
}
