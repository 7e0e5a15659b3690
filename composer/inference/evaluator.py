"""The parts that evaluate a behaviour, and what they share: names, functions and classes."""

from __future__ import annotations

import ast
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, cast

import composer
from composer.inference.attributes import Attributes
from composer.inference.calls import Calls
from composer.inference.expressions import Expressions
from composer.inference.message_types import item_of, split_part
from composer.inference.payloads import Payloads
from composer.inference.signatures import explain_misfit
from composer.inference.scopes import LocalNames, Scope, find_local_names
from composer.inference.statements import Statements
from composer.inference.values import (
    CHOSEN,
    NODE,
    NONE,
    UNKNOWN,
    Alternatives,
    Argument,
    Arguments,
    ArrayField,
    Awaitable,
    BoundMethod,
    Class,
    Constant,
    External,
    Function,
    Generated,
    Instance,
    Mapping,
    Message,
    MessageClass,
    NodeValue,
    Partial,
    PartOfNode,
    Place,
    ProjectModule,
    Scalar,
    Sequence,
    Value,
    alternatives,
    constant,
    is_chosen,
    is_none,
    join,
    truth_of,
)
from composer.interfaces.catalogue import InterfaceKind
from composer.python_source.annotations import find_interface
from composer.python_source.modules import FunctionKind, FunctionSource, read_signature
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.inference.run import Run
    from composer.python_source.modules import ModuleSource

# How deep helpers of helpers are followed.
_DEEPEST = 12
FOLDERS: tuple[InterfaceKind, ...] = ('msg', 'srv', 'action')
_TRANSPARENT = {
    'contextlib.contextmanager',
    'functools.cache',
    'functools.lru_cache',
    'functools.wraps',
    'builtins.staticmethod',
    'typing.no_type_check',
    'typing.final',
    'typing_extensions.override',
    'typing.override',
}


class Evaluator:
    """Evaluates expressions and follows statements and functions, in one run.

    Attributes:
        kept: Objects of classes of the project that are kept in the state, by their names there.
        call_places: Where the calls under way are written.
        lasting_doubts: Of each function under way, the doubts that last until its end.
    """

    def __init__(self, run: Run) -> None:
        self.run = run
        self.lasting_doubts: list[int] = [0]
        self.expressions = Expressions(self)
        self.statements = Statements(self)
        self.calls = Calls(self)
        self.attributes = Attributes(self)
        self.payloads = Payloads(self)
        self.call_places: list[Place] = []
        self.kept: dict[str, Value] = {}
        self._active: list[ast.AST] = []
        self._results: dict[tuple[object, ...], Value] = {}
        self._local_names: dict[int, LocalNames] = {}

    def evaluate(self, node: ast.expr, scope: Scope) -> Value:
        """Return what an expression may be."""
        return self.expressions.evaluate(node, scope)

    # Names

    def look_up(self, node: ast.Name, scope: Scope) -> Value:
        """Return what a name stands for."""
        name = node.id
        current: Scope | None = scope
        while current is not None:
            if name in current.local:
                value = current.latest(name) if current is not scope else None
                if current.names is not None and name in current.names:
                    value = current.names[name]
                return UNKNOWN if value is None else value
            current = current.outer
        modules = self.run.modules
        if not modules.has_name(scope.module, name):
            place = Place(scope.module, node)
            known = [*modules.top(scope.module).statements, *scope.all_names()]
            message = f"'{name}' is not defined"
            self.run.report('undefined-name', place, message, suggest(name, known))
            return UNKNOWN
        return self.top_value(scope.module, name)

    def top_value(self, module: ModuleSource, name: str) -> Value:
        """Return what a name at the top of a module stands for."""
        self.run.reading.modules.setdefault(id(module), module)

        def evaluate(statement: ast.AST, is_conditional: bool) -> Value:  # noqa: FBT001
            scope = Scope(module)
            with self.run.afresh(is_guard=is_conditional):
                if isinstance(statement, ast.Import | ast.ImportFrom):
                    return self.imported(module, statement, name)
                self.statements.follow_all([cast('ast.stmt', statement)], scope)
            return (scope.names or {}).get(name, UNKNOWN)

        return self.run.modules.value(module, name, evaluate)

    def imported(
        self, module: ModuleSource, statement: ast.Import | ast.ImportFrom, name: str
    ) -> Value:
        """Return what an import stores under a name."""
        full_name = self.run.modules.imported(module, statement, name)
        if not full_name:
            return UNKNOWN
        home, inner = self.run.modules.split(full_name)
        if home is not None:
            if not inner:
                return ProjectModule(home)
            if self.run.modules.has_name(home, inner):
                return self.top_value(home, inner)
        place = Place(module, next(each for each in statement.names if _stored(each) == name))
        if home is not None:
            if not self.is_module_in(home, inner):
                known = self.run.modules.top(home).statements
                self._report_import(
                    place, f"there is no '{inner}' in {home.source.name}", known, inner
                )
            return UNKNOWN
        return self.external(full_name, place)

    def external(self, full_name: str, place: Place) -> Value:
        """Return what a full name stands for that is not of the project."""
        interface = find_interface(full_name)
        if interface is None:
            package, _, name = full_name.partition('.')
            if package == 'composer' and name and name not in composer.__all__:
                if '.' not in name and name.islower() is False:
                    self._report_import(place, f"composer has no '{name}'", composer.__all__, name)
                return UNKNOWN
            catalogue = self.run.types.catalogue
            folder = name.partition('.')[0]
            if name and folder not in FOLDERS and package in catalogue.packages():
                if folder.isidentifier() and not folder.startswith('_'):
                    folders = [each for each in FOLDERS if catalogue.names(each, package)]
                    self._report_import(place, f"{package} has no '{folder}'", folders, folder)
            return External(full_name)
        whole, _ = split_part(interface)
        package, kind, name = whole.split('/')
        catalogue = self.run.types.catalogue
        if package in catalogue.packages() and not catalogue.has(whole):
            names = catalogue.names(cast('InterfaceKind', kind), package)
            known = [each.rpartition('/')[2] for each in names]
            several = [
                *(f'{other}/{kind}/{name}' for other in catalogue.packages()),
                *(f'{package}/{other}/{name}' for other in FOLDERS),
            ]
            elsewhere = [each for each in several if catalogue.has(each)]
            if elsewhere:
                known = []
            self._report_import(
                place, f"{package}.{kind} has no '{name}'", known, name, elsewhere[:1]
            )
        return MessageClass(interface)

    def _report_import(
        self,
        place: Place,
        message: str,
        known: Iterable[str],
        name: str,
        elsewhere: Iterable[str] = (),
    ) -> None:
        found = [each.replace('/', '.') for each in elsewhere]
        help_text = f"did you mean '{found[0]}'?" if found else suggest(name, known)
        self.run.report('bad-import', place, message, help_text)

    def check_imports(self, module: ModuleSource) -> None:
        """Check the names that a module imports, those of helpers included."""
        for statement in module.body:
            if isinstance(statement, ast.Import | ast.ImportFrom):
                for alias in statement.names:
                    if alias.name != '*':
                        self.imported(module, statement, _stored(alias))

    def is_module_in(self, package: ModuleSource, name: str) -> bool:
        """Return whether a package has a module of this name."""
        path = package.path
        if path is None or path.name != '__init__.py':
            return False
        return (path.parent / f'{name}.py').exists() or (path.parent / name).is_dir()

    def read_target(self, target: ast.expr, scope: Scope) -> Value:
        """Return what the target of `+=` holds."""
        if isinstance(target, ast.Name):
            return self.look_up(target, scope)
        if isinstance(target, ast.Attribute):
            owner = self.evaluate(target.value, scope)
            return self.attributes.read(owner, target.attr, Place(scope.module, target))
        if isinstance(target, ast.Subscript):
            owner = self.evaluate(target.value, scope)
            index = self.evaluate(target.slice, scope)
            self.attributes.read_item(owner, index, Place(scope.module, target.slice))
        return UNKNOWN

    def awaited(self, node: ast.expr, scope: Scope) -> Value:
        """Return what an operand may be, which should be no coroutine."""
        value = self.evaluate(node, scope)
        if isinstance(value, Awaitable):
            text = 'this is a coroutine, which has not been awaited'
            self.run.report(
                'missing-await', Place(scope.module, node), text, 'put await before it'
            )
            return value.result
        return value

    def tested(self, node: ast.expr, scope: Scope) -> Value:
        """Return what a condition may be: a coroutine is always true."""
        return self.awaited(node, scope)

    def iterated(self, node: ast.expr, scope: Scope, is_async: int) -> Value:
        """Return what a loop goes through."""
        value = self.awaited(node, scope)
        if isinstance(value, Generated) and value.is_async and not is_async:
            text = 'this is an async generator'
            place = Place(scope.module, node)
            self.run.report('missing-await', place, text, "go through it with 'async for'")
        return value

    @contextmanager
    def branch(self, test: Value, *, is_taken: bool) -> Iterator[None]:
        """Read a branch: one that is never taken has no problems, and may use names.

        What the file decides on may be decided otherwise by the next file, or a parameter.
        """
        truth = truth_of(test)
        is_dead = truth is not None and truth != is_taken
        is_doubt = is_dead or (truth is None and is_chosen(test))
        with ExitStack() as around:
            around.enter_context(self.run.condition(is_doubt=is_doubt))
            if is_dead and not is_chosen(test):
                around.enter_context(self.run.silence())
            yield

    def home_of(self, scope: Scope) -> Scope:
        """Return the scope of the function itself: comprehensions have their own."""
        while scope.function is not None and scope.outer is not None:
            if scope.outer.function is not scope.function:
                break
            scope = scope.outer
        return scope

    def narrow(self, test: ast.expr, scope: Scope, *, is_true: bool) -> None:
        """Use what is known after a test."""
        match test:
            case ast.UnaryOp(op=ast.Not()):
                self.narrow(test.operand, scope, is_true=not is_true)
            case ast.BoolOp():
                if isinstance(test.op, ast.And) == is_true:
                    for each in test.values:
                        self.narrow(each, scope, is_true=is_true)
            case ast.Name():
                self._drop_none(test, scope, has_value=is_true)
            case ast.Compare(
                left=ast.Name() as name, ops=[sign], comparators=[ast.Constant(None)]
            ):
                if isinstance(sign, ast.Is | ast.IsNot | ast.Eq | ast.NotEq):
                    is_none = isinstance(sign, ast.Is | ast.Eq)
                    self._drop_none(name, scope, has_value=is_none != is_true)
            case ast.Call(func=ast.Name(id=function), args=[ast.Name() as name, *_]):
                if function in ('isinstance', 'hasattr', 'callable', 'issubclass'):
                    with self.run.silence():
                        is_known = truth_of(self.evaluate(test, scope)) is not None
                    if not is_known:
                        self._forget(name, scope, is_true=is_true)
            case ast.Compare(left=ast.Call(func=ast.Name(id='type'), args=[ast.Name() as name])):
                self._forget(name, scope, is_true=True)

    def _drop_none(self, name: ast.Name, scope: Scope, *, has_value: bool) -> None:
        value = scope.names.get(name.id) if scope.names is not None else None
        if isinstance(value, Alternatives) and has_value:
            kept = [each for each in value.values if not is_none(each)]
            scope.set(name.id, join(kept) if kept else UNKNOWN)

    def _forget(self, name: ast.Name, scope: Scope, *, is_true: bool) -> None:
        """Forget what a name stands for, as the test of its type is not decided by that."""
        value = scope.names.get(name.id) if scope.names is not None else None
        is_sure = isinstance(value, NodeValue) or (isinstance(value, Message) and not is_true)
        if value is not None and not is_sure:
            scope.set(name.id, UNKNOWN)

    # What is in something

    def item_of(self, value: Value) -> Value:
        """Return what an item of something iterated is."""
        return join(self._item_of(each) for each in alternatives(value))

    def _item_of(self, value: Value) -> Value:
        match value:
            case ArrayField():
                return item_of(value.type)
            case Sequence():
                return value.item()
            case Generated():
                return value.yielded
            case Mapping() if not (value.is_open or value.is_lost) and value.entries:
                return join(constant(key) for key in value.entries)
            case Constant() | Scalar() if value.kind is str:
                return Scalar(str)
            case PartOfNode(name='parameters'):
                self.run.reading.open_kinds.add('parameter')
        return CHOSEN if is_chosen(value) else UNKNOWN

    def entered(self, value: Value) -> Value:
        """Return what `with value as name` stores."""
        return join(
            each.yielded if isinstance(each, Generated) else UNKNOWN
            for each in alternatives(value)
        )

    def keep(self, name: str, value: Value) -> None:
        """Note that an object is kept in `node.state` or `node.own_state`, to be used later."""
        if isinstance(value, Instance):
            self.kept[name] = join([value, self.kept[name]]) if name in self.kept else value
        else:
            self.escape(value)

    def escape(self, value: Value) -> None:
        """Note that something unknown has a value: it may change it, or call it."""
        match value:
            case Alternatives():
                for each in value.values:
                    self.escape(each)
            case NodeValue():
                self.run.reading.open_all()
            case Constant(value=str(text)):
                self.run.reading.mentioned.add(text)
            case PartOfNode(name='parameters'):
                self.run.reading.open_kinds.add('parameter')
            case PartOfNode(name='state'):
                self.run.reading.is_state_open = True
            case BoundMethod(owner=owner) if owner in (NODE, PartOfNode('parameters')):
                self._escape_method(value)
            case Mapping() | Sequence() if not value.is_lost:
                value.is_lost = True
                held = value.entries.values() if isinstance(value, Mapping) else value.items
                for each, _ in list(held):
                    self.escape(each)
            case Function() if not value.is_read and value.definition not in self._active:
                self._follow_later(value)
            case Partial():
                self.calls.invoke_later(value)
            case Instance():
                if any(isinstance(each, NodeValue) for each in value.attributes.values()):
                    self.run.reading.open_all()

    def _escape_method(self, method: BoundMethod) -> None:
        kinds = {
            'publish': 'publisher',
            'call': 'service client',
            'call_async': 'service client',
            'send_goal': 'action client',
            'get': 'parameter',
        }
        if method.name in kinds:
            self.run.reading.open_kinds.add(kinds[method.name])
        elif method.name == 'get_parameters':
            self.run.reading.reads_others = True

    # Functions

    def define(
        self, node: ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda, scope: Scope
    ) -> Function:
        """Return the function that a definition makes."""
        is_top = scope.function is None and scope.outer is None
        function = Function(scope.module, node, None if is_top else scope)
        for default in (*node.args.defaults, *node.args.kw_defaults):
            if default is not None:
                self.evaluate(default, scope)
        if not is_top:
            self.home_of(scope).inner.append(function)
        return function

    def define_decorated(
        self, node: ast.FunctionDef | ast.AsyncFunctionDef, scope: Scope
    ) -> Value:
        """Return what a definition makes, with its decorators."""
        value: Value = self.define(node, scope)
        for decorator in reversed(node.decorator_list):
            by = self.evaluate(decorator, scope)
            if isinstance(by, External) and by.name in _TRANSPARENT:
                continue
            place = Place(scope.module, decorator)
            value = self.calls.invoke(by, Arguments((Argument(value, place),)), place)
        return value

    def is_coroutine(self, function: Function) -> bool:
        """Return whether a call returns a coroutine, which runs when it is awaited."""
        return kind_of(function) is FunctionKind.COROUTINE

    def follow(self, function: Function, arguments: Arguments, *, waits: bool) -> Value:
        """Return what a call of a function may return, and read what it does."""
        function.is_read = True
        key = self._key_of(function, arguments, waits=waits)
        if key is not None and key in self._results:
            return self._results[key]
        if function.definition in self._active or len(self._active) >= _DEEPEST:
            self.calls.escape_all(arguments)
            return UNKNOWN
        if not self.fits(function, arguments):
            return UNKNOWN
        scope = self.enter(function, arguments, waits=waits)
        result = result_of(function, scope)
        if key is not None:
            self._results[key] = result
        return result

    def fits(self, function: Function, arguments: Arguments) -> bool:
        """Return whether a function can be called so; report it if not."""
        if arguments.is_open:
            return True
        given = arguments
        if function.owner is not None:
            me = Argument(function.owner, Place(function.module, function.definition))
            given = Arguments((me, *arguments.positional), arguments.named)
        signature = read_signature(function.definition.args)
        misfit = explain_misfit(signature, given) if signature else None
        if misfit is None or not self.call_places:
            return misfit is None
        definition = function.definition
        name = 'the lambda' if isinstance(definition, ast.Lambda) else f"'{definition.name}'"
        message = f'{name} is called with other arguments than it takes: {misfit}'
        self.run.report('bad-call', self.call_places[-1], message)
        return False

    def _key_of(
        self, function: Function, arguments: Arguments, *, waits: bool
    ) -> tuple[object, ...] | None:
        """Return what a call has to have in common with another one to give the same."""
        values = [argument.value for argument in arguments.all()]
        if any(isinstance(each, Mapping | Sequence | Instance | Alternatives) for each in values):
            return None
        names = tuple(name for name, _ in arguments.named)
        run = self.run
        at = (bool(run.doubts), bool(run.guards), run.is_silent, waits, arguments.is_open)
        owner = function.owner if not isinstance(function.owner, Instance) else id(function.owner)
        return (id(function.definition), id(function.outer), owner, names, at, *values)

    def enter(self, function: Function, arguments: Arguments, *, waits: bool) -> Scope:
        """Follow the body of a function; return its scope at its end."""
        definition = function.definition
        if id(definition) not in self._local_names:
            self._local_names[id(definition)] = find_local_names(definition)
        names = self._local_names[id(definition)]
        scope = Scope(
            function.module, function, function.outer, names.local, names.unsure, waits=waits
        )
        self._bind(function, arguments, scope)
        self._active.append(definition)
        self.run.modules.followed.add(id(definition))
        self.lasting_doubts.append(0)
        try:
            if isinstance(definition, ast.Lambda):
                value = self.evaluate(definition.body, scope)
                scope.returned.append((value, Place(function.module, definition.body)))
                scope.names = None
            else:
                self.statements.follow_all(definition.body, scope)
                if scope.names is not None:
                    scope.returned.append((NONE, Place(function.module, definition)))
            for inner in scope.inner:
                if not inner.is_read:
                    # Nobody seems to call it.
                    self.run.doubts += 1
                    self._follow_later(inner)
                    self.run.doubts -= 1
        finally:
            self.run.doubts -= self.lasting_doubts.pop()
            self._active.pop()
        return scope

    def _follow_later(self, function: Function) -> None:
        """Read a function that something else may call, with anything."""
        with self.run.condition():
            self.follow(function, Arguments(is_open=True), waits=False)

    def _bind(self, function: Function, arguments: Arguments, scope: Scope) -> None:
        """Store the arguments of a call in the parameters."""
        parameters = function.definition.args
        positional = [*parameters.posonlyargs, *parameters.args]
        given = list(arguments.positional)
        if function.owner is not None:
            given.insert(0, Argument(function.owner, Place(function.module, function.definition)))
        named = dict(arguments.named)
        for parameter, argument in zip(positional, given, strict=False):
            scope.set(parameter.arg, argument.value)
        rest = given[len(positional) :]
        defaults = dict(
            zip(
                [each.arg for each in reversed(positional)],
                reversed(parameters.defaults),
                strict=False,
            )
        )
        defaults |= {
            each.arg: default
            for each, default in zip(parameters.kwonlyargs, parameters.kw_defaults, strict=True)
            if default is not None
        }
        for parameter in (*positional[len(given) :], *parameters.kwonlyargs):
            name = parameter.arg
            if name in named:
                scope.set(name, named.pop(name).value)
            elif name in defaults and not arguments.is_open:
                outer = function.outer or Scope(function.module)
                with self.run.silence():
                    scope.set(name, self.evaluate(defaults[name], outer))
            else:
                scope.set(name, UNKNOWN)
        if parameters.vararg:
            items = [(argument.value, argument.place) for argument in rest]
            scope.set(parameters.vararg.arg, Sequence(items, tuple, arguments.is_open))
        if parameters.kwarg:
            entries: dict[object, tuple[Value, Place]] = {
                name: (argument.value, argument.place) for name, argument in named.items()
            }
            scope.set(
                parameters.kwarg.arg, Mapping(entries, arguments.is_open, self.run.conditions)
            )

    # Classes

    def instantiate(self, of: Class, arguments: Arguments) -> Value:
        """Return an object of a class."""
        made = Instance(of)
        init = self.class_attribute(of, '__init__', made)
        if isinstance(init, Function):
            self.follow(init, arguments, waits=True)
        elif self._is_dataclass(of):
            fields = [
                each.target.id
                for each in of.definition.body
                if isinstance(each, ast.AnnAssign)
                and isinstance(each.target, ast.Name)
                and 'ClassVar' not in ast.unparse(each.annotation)
            ]
            # Fields of bases come first.
            fields = [] if of.definition.bases else fields
            for name, argument in zip(fields, arguments.positional, strict=False):
                made.set(name, argument.value)
            for name, argument in arguments.named:
                made.set(name, argument.value)
        else:
            self.calls.escape_all(arguments)
            return made if not of.definition.bases else UNKNOWN
        return made

    def _is_dataclass(self, of: Class) -> bool:
        names = {
            ast.unparse(each.func if isinstance(each, ast.Call) else each)
            for each in of.definition.decorator_list
        }
        return bool(names & {'dataclass', 'dataclasses.dataclass'})

    def class_attribute(self, of: Class, name: str, owner: Instance | None) -> Value | None:
        """Return what a class stores under a name; a method is bound to `owner`."""
        for statement in of.definition.body:
            if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef):
                if statement.name == name:
                    return self._method(of, statement, owner)
            elif isinstance(statement, ast.Assign | ast.AnnAssign) and statement.value:
                targets = (
                    statement.targets if isinstance(statement, ast.Assign) else [statement.target]
                )
                if any(isinstance(each, ast.Name) and each.id == name for each in targets):
                    is_plain = not of.definition.bases and not self._is_dataclass(of)
                    with self.run.silence():
                        value = self.evaluate(statement.value, self._scope_of(of))
                    return value if is_plain and self.is_stored_once(of, name) else UNKNOWN
        for base in of.definition.bases:
            with self.run.silence():
                found = self.evaluate(base, self._scope_of(of))
            if isinstance(found, Class) and found is not of:
                inherited = self.class_attribute(found, name, owner)
                if inherited is not None:
                    return inherited
        return None

    def _scope_of(self, of: Class) -> Scope:
        return of.outer or Scope(of.module)

    def _method(
        self, of: Class, node: ast.FunctionDef | ast.AsyncFunctionDef, owner: Instance | None
    ) -> Value:
        decorators = {ast.unparse(each) for each in node.decorator_list}
        function = Function(of.module, node, of.outer)
        if 'staticmethod' in decorators:
            return function
        if 'classmethod' in decorators:
            function.owner = of
            return function
        if owner is None:
            return function
        function.owner = owner
        if decorators & {'property', 'cached_property', 'functools.cached_property'}:
            return self.follow(function, Arguments(), waits=True)
        return UNKNOWN if decorators else function

    def is_stored_once(self, of: Class, name: str) -> bool:
        """Return whether the module stores an attribute of this name in one place only."""
        key = (id(of.module), name)
        if key not in self.run.modules.attribute_stores:
            self.run.modules.attribute_stores[key] = sum(
                isinstance(node, ast.Attribute)
                and node.attr == name
                and not isinstance(node.ctx, ast.Load)
                for statement in of.module.body
                for node in ast.walk(statement)
            )
        return self.run.modules.attribute_stores[key] <= 1


def _stored(alias: ast.alias) -> str:
    """Return the name that an import stores."""
    return alias.asname or alias.name.partition('.')[0]


def kind_of(function: Function) -> FunctionKind:
    """Return what a call of a function returns."""
    if isinstance(function.definition, ast.Lambda):
        return FunctionKind.PLAIN
    return FunctionSource(function.definition).kind or FunctionKind.PLAIN


def result_of(function: Function, scope: Scope) -> Value:
    """Return what a call gave, from its scope at its end."""
    returned = join([value for value, _ in scope.returned]) if scope.returned else NONE
    kind = kind_of(function)
    if kind is FunctionKind.COROUTINE:
        return Awaitable(returned)
    if kind.is_generator:
        yielded = join([value for value, _ in scope.yielded]) if scope.yielded else UNKNOWN
        return Generated(yielded, returned, is_async=kind is FunctionKind.ASYNC_GENERATOR)
    return returned
