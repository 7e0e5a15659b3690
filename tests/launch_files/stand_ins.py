"""Objects like those of `launch`, which is on no registry: the same class names and attributes."""

from contextlib import contextmanager
from types import SimpleNamespace


class Substitution:
    def perform(self, context):
        return context.perform_substitution(self)


class TextSubstitution(Substitution):
    def __init__(self, text):
        self.text = text


class LaunchConfiguration(Substitution):
    def __init__(self, name, default=None):
        self.variable_name, self.default = [TextSubstitution(name)], default

    def perform(self, context):
        return context.launch_configurations[self.variable_name[0].text]


class PythonExpression(Substitution):
    def __init__(self, expression):
        self.expression, self.python_modules = expression, []


class PathJoinSubstitution(Substitution):
    def __init__(self, substitutions):
        self.substitutions = substitutions


class Shouted(Substitution):
    """A substitution that nobody knows, and that keeps what it is given."""

    def __init__(self, name):
        self.name = name

    def perform(self, context):
        return f'{context.launch_configurations[self.name]}!'


class Entity:
    def __init__(self, condition=None):
        self.condition = condition

    def execute(self, context):
        raise NotImplementedError


class LaunchDescription:
    def __init__(self, entities):
        self.entities = entities


class DeclareLaunchArgument(Entity):
    def __init__(self, name, default_value=None, description='', choices=None):
        super().__init__()
        self.name, self.default_value, self.description = name, default_value, description
        self.choices = choices


class SetLaunchConfiguration(Entity):
    def __init__(self, name, value, condition=None):
        super().__init__(condition)
        self.name, self.value = name, value


class PushLaunchConfigurations(Entity):
    pass


class PopLaunchConfigurations(Entity):
    pass


class GroupAction(Entity):
    def __init__(self, actions, condition=None):
        super().__init__(condition)
        self.actions = actions

    def get_sub_entities(self):
        return [PushLaunchConfigurations(), *self.actions, PopLaunchConfigurations()]


class PushRosNamespace(Entity):
    def __init__(self, namespace):
        super().__init__()
        self.namespace = namespace


class SetRemap(Entity):
    def __init__(self, src, dst, condition=None):
        super().__init__(condition)
        self.src, self.dst = src, dst


class SetParameter(Entity):
    def __init__(self, param_dict, condition=None):
        super().__init__(condition)
        self.param_dict = param_dict


class SetEnvironmentVariable(Entity):
    def __init__(self, name, value, condition=None):
        super().__init__(condition)
        self.name, self.value = name, value


class TimerAction(Entity):
    def __init__(self, period, actions):
        super().__init__()
        self.period, self.actions = period, actions


class OpaqueFunction(Entity):
    def __init__(self, function):
        super().__init__()
        self.function, self.args, self.kwargs = function, (), {}


class LogInfo(Entity):
    def __init__(self, msg):
        super().__init__()
        self.msg = msg


class Shutdown(Entity):
    pass


class OnProcessExit:
    def __init__(self, target, actions):
        self.action_matcher, self.actions_on_event = target, actions


class RegisterEventHandler(Entity):
    def __init__(self, event_handler):
        super().__init__()
        self.event_handler = event_handler


class IfCondition:
    def __init__(self, predicate):
        self.predicate_expression = predicate


class UnlessCondition(IfCondition):
    pass


class ExecuteLocal(Entity):
    def __init__(self, cmd, *, condition=None, **keys):
        super().__init__(condition)
        self.cmd, self.shell = cmd, keys.get('shell', False)
        self.respawn, self.respawn_delay = keys.get('respawn', False), keys.get('respawn_delay')
        self.on_exit = keys.get('on_exit')
        self.sigterm_timeout = self.sigkill_timeout = '5'
        self.process_description = SimpleNamespace(
            env=None,
            additional_env=keys.get('additional_env'),
            cwd=keys.get('cwd'),
            prefix=keys.get('prefix'),
        )


class Node(ExecuteLocal):
    def __init__(self, package, executable, **keys):
        super().__init__([executable], **keys)
        self.package, self.node_executable = package, executable
        self.node_name, self.node_namespace = keys.get('name'), keys.get('namespace')
        self.parameters, self.remappings = keys.get('parameters'), keys.get('remappings')
        self.arguments, self.ros_arguments = keys.get('arguments'), keys.get('ros_arguments')


class ComposableNode:
    def __init__(self, name, namespace=None, remappings=()):
        self.node_name, self.node_namespace, self.condition = name, namespace, None
        self.package, self.node_plugin = 'image_proc', 'image_proc::Rectify'
        # As in launch_ros: they can be read once.
        self.remappings = iter(remappings)


class LoadComposableNodes(Entity):
    def __init__(self, target, components, condition=None):
        super().__init__(condition)
        self.target_container, self.composable_node_descriptions = target, components


class ParameterFile:
    def __init__(self, param_file):
        self.param_file, self.allow_substs = param_file, False


class RewrittenYaml(Substitution):
    """As that of nav2."""

    def __init__(self, source_file, param_rewrites):
        self.source_file, self.param_rewrites = source_file, param_rewrites
        self.convert_types, self.root_key = True, None


class Context:
    def __init__(self):
        self.names = []
        self.launch_configurations = _Noting(self)

    def perform_substitution(self, substitution):
        return substitution.perform(self)


class _Noting(dict):
    def __init__(self, context):
        super().__init__()
        self._context = context

    def __getitem__(self, name):
        self._context.names.append(name)
        return super().__getitem__(name)

    def __contains__(self, name):
        self._context.names.append(name)
        return super().__contains__(name)

    def get(self, name):
        self._context.names.append(name)
        return super().get(name)


class Loader:
    """As that of Composer, for descriptions that are there already."""

    def __init__(self):
        self.context = Context()

    def origin_of(self, entity):
        return f'line 1 of {type(entity).__name__}'

    def parse(self, text):
        return text

    @contextmanager
    def reading(self):
        self.context.names = []
        yield self.context.names
