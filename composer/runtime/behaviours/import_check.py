"""Import behaviours, and check the functions against how they are called."""

from __future__ import annotations

import importlib.util
import sys
from contextlib import contextmanager, redirect_stdout
from typing import TYPE_CHECKING, Any

from composer.checks.behaviours.behaviour_functions import check_behaviour_call
from composer.diagnostics import diagnostic_at
from composer.errors import ComposerError
from composer.interfaces.declared_packages import import_declared
from composer.language.bindings import system_bindings
from composer.python_source.modules import ModuleSource
from composer.runtime.behaviours import callables as behaviours

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.bindings import Binding
    from composer.language.specs import SystemSpec

_OF_ROS = ('rclpy', 'rcl_interfaces', 'builtin_interfaces', 'rosidl_runtime_py')
_OF_ROS_ENDINGS = ('_msgs', '_srvs', '_interfaces')


def import_behaviours(
    context: CheckContext, spec: SystemSpec, elsewhere: Iterable[tuple[Binding, Any]] = ()
) -> tuple[dict[str, Callable[..., Any]], list[Diagnostic]]:
    """Import every behaviour; return the functions by name, and the findings about them.

    Args:
        spec: The part of the system that runs in this process.
        elsewhere: The behaviours of other processes, with the shape of each, or the text and the
            help of an error.
    """
    functions: dict[str, Callable[..., Any]] = {}
    findings: list[Diagnostic] = []
    # Many nodes may have the same.
    shapes: dict[str, behaviours.Shape] = {}
    for binding in system_bindings(spec):
        behaviour = binding.behaviour
        if behaviour.name not in shapes:
            try:
                functions[behaviour.name] = function = behaviours.import_behaviour(behaviour)
            except behaviours.BehaviourImportError as error:
                findings.append(_explain(context, binding, error))
                continue
            shapes[behaviour.name] = behaviours.shape_of(function)
        findings += check_behaviour_call(context, binding, *shapes[behaviour.name])
    for binding, (first, second) in elsewhere:
        if isinstance(first, str):
            failure = behaviours.BehaviourImportError(first, help=second)
            findings.append(_explain(context, binding, failure))
        else:
            findings += check_behaviour_call(context, binding, first, second)
    return functions, findings


class ImportCheck:
    """Imports the behaviours without findings in their source, and checks the functions.

    Attributes:
        missing_ros: The modules that could not be imported because this Python has no ROS.
    """

    def __init__(self) -> None:
        self.missing_ros: set[str] = set()

    def __call__(self, context: CheckContext, found: list[Diagnostic]) -> Iterator[Diagnostic]:
        """Yield findings about the functions, except where their source already has findings."""
        try:
            _import_interfaces(context)
        except ComposerError as error:
            span = context.system.positions.key(('interfaces',))
            yield diagnostic_at(span, 'broken-behaviour', str(error), help=error.help)
            return
        with _own_modules(context):
            was_told = any(each.rule == 'missing-module' for each in found)
            for binding in system_bindings(context.spec):
                if context.was_dropped(binding.behaviour.path):
                    continue
                if not _has_finding(context, binding, found):
                    yield from self._check(context, binding, was_told=was_told)

    def _check(
        self, context: CheckContext, binding: Binding, *, was_told: bool
    ) -> Iterator[Diagnostic]:
        """Check a behaviour.

        Args:
            was_told: Whether there are findings about modules that are missing.
        """
        try:
            # What a module prints must not end up in the report.
            with redirect_stdout(sys.stderr):
                function = behaviours.import_behaviour(binding.behaviour)
        except behaviours.BehaviourImportError as error:
            if _lacks_ros(error):
                self.missing_ros.add(binding.behaviour.module)
            elif not (was_told and isinstance(error.__cause__, ImportError)):
                yield _explain(context, binding, error)
            return
        yield from check_behaviour_call(context, binding, *behaviours.shape_of(function))


def _import_interfaces(context: CheckContext) -> None:
    """Build the interface packages that the file declares, as a start does.

    Raises:
        ComposerError: One of them cannot be built or imported.
    """
    # What has errors is reported already, and without ROS nothing can be built.
    if context.catalogue.available and not context.interfaces.unreadable:
        import_declared(context.interfaces, _show_progress)


def _show_progress(line: str) -> None:
    sys.stderr.write(f'{line}\n')


def _explain(
    context: CheckContext, binding: Binding, error: behaviours.BehaviourImportError
) -> Diagnostic:
    spec = binding.behaviour
    return context.at_value(
        spec.path, 'broken-behaviour', str(error), part=spec.name, help=error.help
    )


def _has_finding(context: CheckContext, binding: Binding, found: list[Diagnostic]) -> bool:
    """Return whether a behaviour or its arguments already have a finding."""
    module = context.modules.find(binding.behaviour.module)
    if isinstance(module, ModuleSource) and module.syntax_error is not None:
        return True
    path = binding.behaviour.path
    place = context.system.positions.value(path)
    arguments = (*path[:-1], 'with')
    given = {
        context.system.positions.key((*arguments, name)) for name in binding.behaviour.arguments
    }
    return any(
        finding.span in given
        or (
            finding.span is not None
            and finding.span.source is place.source
            and finding.span.line == place.line
            and place.column <= finding.span.column < place.column + max(place.length, 1)
        )
        for finding in found
    )


def _lacks_ros(error: behaviours.BehaviourImportError) -> bool:
    cause = error.__cause__
    if not isinstance(cause, ModuleNotFoundError) or importlib.util.find_spec('rclpy'):
        return False
    top = (cause.name or '').partition('.')[0]
    return top in _OF_ROS or top.endswith(_OF_ROS_ENDINGS)


@contextmanager
def _own_modules(context: CheckContext) -> Iterator[None]:
    """Make a file's modules importable, then forget them: the next file may have others."""
    from composer.python_source.module_finder import project_search_path

    before = set(sys.modules)
    names = {
        *(each.behaviour.module.partition('.')[0] for each in system_bindings(context.spec)),
        *context.spec.interfaces,
    }
    with behaviours.project_on_path(project_search_path(context.system.files)):
        yield
    for name in set(sys.modules) - before:
        if name.partition('.')[0] in names:
            del sys.modules[name]
