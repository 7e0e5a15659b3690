"""Launch descriptions → systems, with stand-ins for the objects of `launch`."""

from pathlib import Path

import pytest
import yaml

from composer.errors import UsageError
from composer.language.pipeline import load_system
from composer.launch_files.description_reader import DescriptionReader
from composer.launch_files.place import Place
from composer.launch_files.results import LaunchError
from composer.launch_files.system_file import render_system
from composer.launch_files.texts import Text, joined, one, split_words
from composer.ros_parameters.file_reader import parse_parameter_file
from tests.launch_files import stand_ins as launch

SIDE = launch.LaunchConfiguration('side')
SIM = launch.LaunchConfiguration('sim')


def python(*parts):
    return [each if not isinstance(each, str) else launch.TextSubstitution(each) for each in parts]


def read(*entities, default='left', **given):
    side = launch.DeclareLaunchArgument('side', default, 'Which one.', ('left', 'right'))
    sim = launch.DeclareLaunchArgument('sim', 'false')
    place = Place(launch.Loader(), given)
    DescriptionReader(place).read([launch.LaunchDescription([side, sim, *entities])])
    return render_system(place.result, Path('x.launch.py'))


def node(**keys):
    return launch.Node('arm', 'drive', **keys)


def resolved(tmp_path, system, *words):
    """Return the processes of a system with these arguments, and no findings."""
    path = tmp_path / 'system.yaml'
    path.write_text(system.text)
    for name, text in system.files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    loaded = load_system(path, words)
    assert not loaded.diagnostics, [each.message for each in loaded.diagnostics]
    return loaded.spec.processes


@pytest.mark.parametrize(
    ('entity', 'data'),
    [
        (node(name='left', namespace=SIDE), {'name': 'left', 'namespace': '{{ side }}'}),
        (node(remappings=[('a', ['/', SIDE])]), {'remap': {'a': '/{{ side }}'}}),
        (
            node(parameters=[{'sim': (SIM,), 'frame': (SIDE, launch.TextSubstitution('_base'))}]),
            {'parameters': {'sim': '{{ sim | from_yaml }}', 'frame': '{{ side }}_base'}},
        ),
        (
            node(parameters=[{'text': (launch.TextSubstitution('1.5'),)}]),
            {'parameters': {'text': 1.5}},
        ),
        # launch writes it to a file without quotes.
        (
            node(parameters=[{'x': (launch.TextSubstitution("'2e5'"),), 'y': '1', 'z': '1e5'}]),
            {'parameters': {'x': 2e5, 'y': '1', 'z': 1e5}},
        ),
        (node(respawn=True, respawn_delay=2.0), {'restart': {'when': 'always', 'delay': 2.0}}),
        (node(on_exit=launch.Shutdown()), {'on_exit': 'shutdown'}),
        (node(ros_arguments=['--log-level', 'warn']), {'log_level': 'warn'}),
        (node(arguments=['-x', SIDE]), {'arguments': ['-x', '{{ side }}']}),
        (node(condition=launch.IfCondition(SIM)), {'when': '{{ sim | bool }}'}),
        (node(condition=launch.UnlessCondition(SIM)), {'when': '{{ not (sim | bool) }}'}),
        (
            node(
                condition=launch.IfCondition(
                    launch.PythonExpression(python("'", SIDE, "' == 'left' and not ", 'False'))
                )
            ),
            {'when': "{{ (side == 'left' and (not False)) }}"},
        ),
        (launch.TimerAction(2.5, [node()]), {'delay': 2.5}),
        (
            launch.GroupAction([launch.PushRosNamespace(SIDE), node(namespace='arm')]),
            {'namespace': '{{ side }}/arm'},
        ),
        (
            launch.GroupAction(
                [launch.SetRemap('a', 'b'), node(remappings=[('a', 'c'), ('d', 'e')])]
            ),
            {'remap': {'a': 'b', 'd': 'e'}},
        ),
        (
            launch.GroupAction([launch.SetParameter({'x': 1}), node(parameters=[{'y': 2}])]),
            {'parameters': {'x': 1, 'y': 2}},
        ),
        (
            launch.GroupAction(
                [launch.SetLaunchConfiguration('sim', SIDE), node(arguments=[SIM])],
            ),
            {'arguments': ['{{ side }}']},
        ),
        (
            launch.GroupAction(
                [
                    launch.SetLaunchConfiguration(
                        'side', 'top', condition=launch.IfCondition(SIM)
                    ),
                    node(arguments=[SIDE]),
                ],
            ),
            {'arguments': ["{{ ('top' if sim | bool else side) }}"]},
        ),
    ],
)
def test_what_a_node_is_given(tmp_path, entity, data):
    system = read(entity)
    (process,) = yaml.safe_load(system.text)['processes'].values()
    assert process == {'package': 'arm', 'executable': 'drive', **data}
    resolved(tmp_path, system)


def test_quotes_in_the_default_of_a_word_are_those_of_a_shell():
    words = split_words(joined((Text(('xacro prefix:=',)), one('prefix', '""'), Text((' -x',)))))
    assert [each.text for each in words] == ['xacro', 'prefix:=', '-x']
    assert words[1].written() == """prefix:={{ (prefix | replace('"', '')) }}"""


def test_arguments_remain_arguments(tmp_path):
    system = read(node(arguments=[SIDE]), sim='true')
    assert yaml.safe_load(system.text)['args'] == {
        'side': {
            'type': 'string',
            'default': 'left',
            'description': 'Which one.',
            'choices': ['left', 'right'],
        },
        'sim': {'type': 'string', 'default': 'false'},
    }
    (process,) = resolved(tmp_path, system, 'side:=right').values()
    assert process.arguments == ('right',)


def test_a_condition_holds_for_what_launch_takes_for_true(tmp_path):
    system = read(node(name='fake', condition=launch.IfCondition(SIM)))
    for text, count in (('True', 1), ('1', 1), ('false', 0), ('0', 0)):
        assert len(resolved(tmp_path, system, f'sim:={text}')) == count


def decide(context):
    is_left = context.launch_configurations['side'] == 'left'
    return [node(name='left' if is_left else 'right', arguments=[SIM])]


def change(context):
    context.launch_configurations['sim'] = context.launch_configurations.get('side')
    return [node(arguments=[SIM])]


class Odd:
    def evaluate(self, context):
        return 'side' in context.launch_configurations


class Own(launch.Entity):
    def execute(self, context):
        return [node(arguments=[each]) for each in context.launch_configurations['side'].split()]


@pytest.mark.parametrize(
    ('entity', 'what', 'arguments'),
    [
        (launch.OpaqueFunction(decide), 'OpaqueFunction decide', ['{{ sim }}']),
        (launch.OpaqueFunction(change), 'OpaqueFunction change', ['right']),
        (node(arguments=[launch.Shouted('side')]), 'Shouted', ['right!']),
        (node(condition=Odd()), 'Odd', None),
        (Own(), 'Own', ['right']),
    ],
)
@pytest.mark.parametrize('given', [{'side': 'right'}, {}])
def test_what_code_reads_is_fixed(tmp_path, entity, what, arguments, given):
    """Another value is an error that has the command which imports again."""
    system = read(entity, default='right', **given)
    assert f'{what} was resolved for side:=right\n' in system.text
    for words in ([], ['side:=right']):
        (process,) = yaml.safe_load(system.text)['processes'].values()
        assert process.get('arguments') == arguments
        resolved(tmp_path, system, *words)
    with pytest.raises(UsageError, match="'side': 'left' is not one of right") as caught:
        resolved(tmp_path, system, 'side:=left')
    assert (
        'Which one. Fixed by the import. For another value: composer import' in caught.value.help
    )
    assert 'x.launch.py side:=VALUE' in caught.value.help


def test_components_of_one_name_in_two_namespaces_and_containers(tmp_path):
    components = [
        launch.ComposableNode('rectify', namespace, remappings=[('image', 'image_mono')])
        for namespace in ('front', [SIDE, '_side'], ['/', SIDE], 'rear')
    ]
    system = read(
        launch.DeclareLaunchArgument('other', ''),
        launch.LoadComposableNodes('/all', components),
        launch.LoadComposableNodes(
            launch.LaunchConfiguration('other'), components, launch.IfCondition(SIM)
        ),
    )
    for words, side, containers in (
        ([], 'left', {'/all'}),
        (['sim:=true', 'side:=right', 'other:=box'], 'right', {'/all', '/box'}),
    ):
        processes = resolved(tmp_path, system, *words)
        assert {process.full_name for process in processes.values()} == containers
        for process in processes.values():
            found = {
                (each.namespace, each.name, each.remap) for each in process.components.values()
            }
            namespaces = ('/front', f'/{side}_side', f'/{side}', '/rear')
            rules = (('image', 'image_mono'),)
            assert found == {(namespace, 'rectify', rules) for namespace in namespaces}


def test_what_begins_when_another_ends_waits_for_it(tmp_path):
    first = node(name='first')
    handler = launch.OnProcessExit(first, [node(name='second')])
    system = read(launch.RegisterEventHandler(handler), first)
    second = yaml.safe_load(system.text)['processes']['second']
    assert second['wait_for'] == {'process': 'first', 'state': 'ended'}
    resolved(tmp_path, system)


def test_what_cannot_be_kept_is_a_comment_with_its_line():
    system = read(launch.LogInfo(['Hello, ', SIDE]), node())
    assert system.text.endswith(
        '# Not kept as it was:\n# line 1 of LogInfo: LogInfo: Hello, left\n'
    )


def test_values_after_a_file_that_has_them_too_are_in_a_file_of_their_own(tmp_path):
    (tmp_path / 'own.yaml').write_text('/**: {ros__parameters: {x: 1, y: 1}}\n')
    system = read(
        node(
            name='a',
            parameters=[
                {'x': 0},
                launch.ParameterFile(str(tmp_path / 'own.yaml')),
                {'y': 2, 'z': 3},
            ],
        )
    )
    data = yaml.safe_load(system.text)['processes']['a']
    assert data['parameters'] == {'x': 0}
    assert data['parameter_files'] == [str(tmp_path / 'own.yaml'), 'x.params/a.yaml']
    assert yaml.safe_load(system.files['x.params/a.yaml']) == {
        '/**/a': {'ros__parameters': {'y': 2, 'z': 3}}
    }


def test_a_rewritten_file_is_read_as_launch_reads_it(tmp_path):
    """PyYAML takes the key `no` for false, and writes a text that is a number without quotes."""
    (tmp_path / 'own.yaml').write_text("a: {ros__parameters: {no: 1, x: '1e-10', y: 1e-10, z: a}}")
    rewritten = launch.RewrittenYaml(str(tmp_path / 'own.yaml'), {'z': 'b'})
    system = read(node(name='a', parameters=[launch.ParameterFile([rewritten])]))
    data = yaml.safe_load(system.text)['processes']['a']
    found = [
        parse_parameter_file(system.files[name], name).entries for name in data['parameter_files']
    ]
    assert [[(each.name, each.value) for each in entries] for entries in found] == [
        [('false', 1), ('x', 1e-10), ('y', 1e-10), ('z', 'a')],
        [('z', 'b')],
    ]


@pytest.mark.parametrize('is_scoped', [False, True], ids=['plain', 'in a group'])
def test_what_a_condition_sets_is_set_when_it_holds(tmp_path, is_scoped):
    holds, fails = launch.IfCondition(SIM), launch.UnlessCondition(SIM)
    settings = [
        launch.SetParameter({'use_sim_time': True, 'x': 1}, holds),
        launch.SetParameter({'use_sim_time': False}, fails),
        launch.SetRemap('a', 'b', holds),
        launch.SetRemap('d', 'e', holds),
        launch.SetEnvironmentVariable('LEVEL', '3', holds),
    ]
    parts = [*settings, node(name='n', remappings=[('a', 'c')])]
    for given in ('true', 'false'):
        system = read(*([launch.GroupAction(parts)] if is_scoped else parts), sim=given)
        (on,) = resolved(tmp_path, system, 'sim:=true').values()
        (off,) = resolved(tmp_path, system, 'sim:=false').values()
        assert (dict(on.parameters), dict(off.parameters)) == (
            {'use_sim_time': True, 'x': 1},
            {'use_sim_time': False},
        )
        assert (dict(on.remap), dict(off.remap)) == (
            {'a': 'b', 'd': 'e'},
            {'a': 'c', 'd': 'd'},
        )
        assert yaml.safe_load(system.text)['environment'] == {
            'LEVEL': "{{ ('3' if sim | bool else none) }}"
        }


@pytest.mark.parametrize('name', ['args', 'input/cloud', 'depth.profile'])
def test_any_name_of_an_argument_is_kept(tmp_path, name):
    argument = launch.DeclareLaunchArgument(name, 'as it was')
    system = read(argument, node(arguments=[launch.LaunchConfiguration(name)]))
    for words, expected in (([], 'as it was'), ([f'{name}:=new'], 'new')):
        (process,) = resolved(tmp_path, system, *words).values()
        assert process.arguments == (expected,)


def test_what_is_required_stays_so(tmp_path):
    port, model = (
        launch.DeclareLaunchArgument('port'),
        launch.DeclareLaunchArgument('model', choices=('a', 'b')),
    )
    system = read(port, model, node(), port='/dev/x')
    args = yaml.safe_load(system.text)['args']
    assert (args['port'], args['model']) == (
        {'type': 'string'},
        {'type': 'string', 'choices': ['a', 'b']},
    )
    with pytest.raises(UsageError, match="'port' is missing; 'model' is missing"):
        resolved(tmp_path, system, 'sim:=true')


def test_a_configuration_that_nothing_declares_is_an_argument(tmp_path):
    frame = launch.LaunchConfiguration('frame', [SIDE, '_base'])
    system = read(node(arguments=[frame]))
    for words, expected in ((['side:=right'], 'right_base'), (['frame:=map'], 'map')):
        (process,) = resolved(tmp_path, system, *words).values()
        assert process.arguments == (expected,)


def test_a_prefix_that_sleeps_is_a_delay():
    prefix = """/bin/sh -c 'sleep 2.5 && exec "$0" "$@"'"""
    (process,) = yaml.safe_load(read(node(prefix=prefix)).text)['processes'].values()
    assert process['delay'] == 2.5


def test_an_argument_without_a_value_is_asked_for():
    with pytest.raises(LaunchError, match="requires the argument 'port'") as caught:
        read(launch.DeclareLaunchArgument('port'))
    assert caught.value.help == 'give it a value: port:=…'


def test_a_file_that_launch_code_writes_is_copied_beside_the_system(tmp_path):
    written = tmp_path / 'view.rviz'

    def write(context):
        written.write_text(f'side: {context.launch_configurations["side"]}\n')
        return [node(arguments=['-d', str(written), SIM])]

    system = read(launch.OpaqueFunction(write))
    (process,) = resolved(tmp_path, system).values()
    assert process.arguments == ('-d', str(tmp_path / 'x.files' / 'view.rviz'), 'false')
    assert system.files == {'x.files/view.rviz': 'side: left\n'}
    # What stands in it does not follow the argument.
    assert yaml.safe_load(system.text)['args']['side']['choices'] == ['left']
