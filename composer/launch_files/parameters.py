"""Parameters of launch files: mappings and files in their order → the keys of a process."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from composer.launch_files.substitutions import Resolver, class_names, private, read_file
from composer.launch_files.texts import Computed, Text, only_if, read_yaml
from composer.ros_parameters.rcl_values import parse_override

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from composer.launch_files.place import Place
    from composer.launch_files.surroundings import Setting


@dataclass
class Parameters:
    """What a node is given.

    Attributes:
        values: Those that no file overrides.
        files: Paths, mappings of the language, or contents of files yet to be written.
    """

    values: dict[str, Any] = field(default_factory=dict)
    files: list[Any] = field(default_factory=list)


@dataclass
class NewFile:
    """A parameter file that the import writes beside the system.

    Attributes:
        root: The namespace that its nodes are put in.
    """

    data: dict[str, Any]
    root: str = ''


class ParameterReader:
    """Reads the parameters of nodes at one place of a launch file.

    Args:
        is_dumped: Whether launch writes values to files, as for all but components.
    """

    def __init__(self, place: Place, *, is_dumped: bool = False) -> None:
        self._place = place
        self._is_dumped = is_dumped
        self._resolver = Resolver(place)
        self._remark = place.remark
        self._parse = place.loader.parse

    def read(self, given: Iterable[Any], common: Iterable[Any]) -> Parameters:
        """Return the parameters of a node.

        Args:
            common: What `SetParameter` and `SetParametersFromFile` give to all nodes.
        """
        read = Parameters()
        for item in common:
            self._add_common(read, item)
        for item in given:
            kinds = class_names(item)
            if 'ParameterFile' in kinds:
                self._add_file(read, item)
            elif 'Parameter' in kinds:
                self._add_values(read, {self._resolver.text(item.name).written(): self._one(item)})
            else:
                self._add_values(read, self.values(item))
        return read

    def _add_common(self, read: Parameters, item: Setting) -> None:
        when = self._place.scope.besides(item)
        if isinstance(item.value, Text):
            path = item.value.written()
            read.files.append(only_if(when, path, None, is_true=item.holds))
            return
        name, value = item.value
        if when and (read.files or isinstance(value, dict)):
            self._place.result.freeze(when)
            when = ''
            if not item.holds:
                return
        value = only_if(when, value, read.values.get(name), is_true=item.holds)
        self._add_values(read, {name: value})

    def values(self, written: Mapping[Any, Any]) -> dict[str, Any]:
        """Return the values of a mapping that `launch_ros` has normalized."""
        found = {}
        for key, value in written.items():
            name = self._resolver.text(key).written()
            found[name] = self._value(value)
        return found

    def _one(self, item: Any) -> Any:
        return self._value(private(item, 'parameter_value'))

    def _value(self, written: Any) -> Any:
        if 'ParameterValue' in class_names(written):
            return self._described(written)
        if isinstance(written, tuple) and written and isinstance(written[0], list | tuple):
            return [self._resolver.text(each).typed() for each in written]
        if isinstance(written, tuple) and written and hasattr(written[0], 'perform'):
            return self._command(written) or self._resolver.text(written).typed()
        return list(written) if isinstance(written, tuple) else written

    def _described(self, written: Any) -> Any:
        value, kind = private(written, 'value'), private(written, 'value_type')
        if not (isinstance(value, list | tuple) or hasattr(value, 'perform')):
            return value
        command = self._command(value)
        if command:
            return command
        if kind in (None, str):
            text = self._resolver.text(value)
            return text.written() if kind is str else text.typed()
        if isinstance(value, list | tuple) and value and not hasattr(value[0], 'perform'):
            return [self._typed(each, kind) for each in value]
        return self._typed(value, kind)

    def _typed(self, written: Any, kind: Any) -> Any:
        if isinstance(written, bool | int | float):
            return written
        text = self._resolver.text(written)
        if kind is float or kind == list[float]:
            if text.is_constant:
                read = read_yaml(text.text)
                return [float(x) for x in read] if isinstance(read, list) else float(text.text)
            return Computed(f'{{{{ {text.code} | float }}}}', float(text.text))
        return text.written() if kind is str else text.typed()

    def _command(self, written: Any) -> dict[str, Any] | None:
        words = self._resolver.command_words(written)
        return {'command': [word.written() for word in words]} if words else None

    def _add_values(self, read: Parameters, values: dict[str, Any]) -> None:
        if self._is_dumped:
            values = {name: _as_dumped(value) for name, value in values.items()}
        if not read.files:
            read.values |= values
            return
        names = set(values)
        if any(names & _names_in(file) for file in read.files):
            read.files.append(NewFile(values))
        else:
            read.values |= values

    def _add_file(self, read: Parameters, item: Any) -> None:
        written = private(item, 'param_file')
        substitutes = private(item, 'allow_substs')
        if (
            isinstance(written, list)
            and len(written) == 1
            and isinstance(substitutes, bool | None)
            and self._add_rewritten(read, written[0], is_template=bool(substitutes))
        ):
            return
        path = self._resolver.text(written)
        is_template = substitutes is True or (
            substitutes is not False and self._resolver.text(substitutes).text.lower() == 'true'
        )
        if not (isinstance(substitutes, bool | None)):
            self._place.result.freeze(self._resolver.text(substitutes))
        data = read_file(path.text) if is_template else {}
        if not isinstance(data, dict):
            self._remark(f"'{path.text}' cannot be read: its substitutions are kept as text")
        elif '$(' in str(data):
            # It is copied, whichever file that is.
            self._place.result.freeze(path)
            read.files.append(NewFile(self._translated(data)))
            return
        if os.path.isfile(path.text) or not os.path.isdir(Path(path.text).parent):
            read.files.append(path.written())
            if self._place.result.is_new_file(path.text):
                self._keep_content(read, path)
        else:
            self._remark(f"there is no parameter file '{path.text}': launch goes on without it")
            if self._place.result.depends(path):
                is_other = f'{path.code} != {path.text!r}'
                read.files.append(only_if(is_other, path.written(), None, is_true=False))

    def _add_rewritten(self, read: Parameters, written: Any, *, is_template: bool) -> bool:
        """Add nav2's `RewrittenYaml`: a file, and the values that it gives to names in it."""
        rewrites = private(written, 'param_rewrites')
        if 'RewrittenYaml' not in class_names(written) or private(written, 'key_rewrites'):
            return False
        resolver = self._resolver
        path = resolver.text(private(written, 'source_file'))
        data = read_file(path.text, is_dumped=True)
        has_substitutions = is_template and '$(' in str(data)
        if not isinstance(data, dict) or any('.' in key for key in rewrites):
            return False
        is_typed = bool(private(written, 'convert_types'))
        by_name, by_value = (
            {
                key: resolver.text(value).typed() if is_typed else resolver.text(value).written()
                for key, value in (given or {}).items()
            }
            for given in (rewrites, private(written, 'value_rewrites'))
        )
        root = resolver.text(private(written, 'root_key')).written()
        # What else is in the file, and where, is that of the file as it is now.
        self._place.result.freeze(path)
        if has_substitutions or data != read_file(path.text):
            copied = self._translated(data) if is_template else data
            read.files.append(NewFile(copied, root))
        else:
            read.files.append({'file': path.written(), 'root': root} if root else path.written())
        changed = _rewritten(data, by_name, by_value)
        if changed:
            read.files.append(NewFile(changed, root))
        return True

    def _keep_content(self, read: Parameters, path: Text) -> None:
        data = read_file(path.text)
        if isinstance(data, dict) and path.is_constant:
            read.files[-1] = NewFile(data)

    def _translated(self, data: Any) -> Any:
        if isinstance(data, dict):
            return {self._plain(key): self._translated(value) for key, value in data.items()}
        if isinstance(data, list):
            return [self._translated(item) for item in data]
        if isinstance(data, str) and '$(' in data:
            return self._resolver.text(self._parse(data)).typed()
        return data

    def _plain(self, key: Any) -> Any:
        if isinstance(key, str) and '$(' in key:
            return self._resolver.text(self._parse(key)).written()
        return key


def _rewritten(data: Any, by_name: dict[str, Any], by_value: dict[str, Any]) -> dict[str, Any]:
    """Return the part of a parameter file that gets other values."""
    changed: dict[str, Any] = {}
    for key, value in data.items():
        if isinstance(value, dict):
            inner = _rewritten(value, by_name, by_value)
            changed |= {key: inner} if inner else {}
        elif key in by_name:
            changed[key] = by_name[key]
        elif isinstance(value, str) and value in by_value:
            changed[key] = by_value[value]
    return changed


def _as_dumped(value: Any) -> Any:
    """Return a value as ROS reads what PyYAML writes: the text `1e-10` has no quotes there."""
    if isinstance(value, list):
        return [_as_dumped(item) for item in value]
    read = parse_override(yaml.safe_dump(value)) if type(value) is str else None
    return read[0] if read and isinstance(read[0], float) else value


def _names_in(file: Any) -> set[str]:
    """Return the names of all parameters in a file; of one that cannot be read, of every name."""
    if isinstance(file, NewFile):
        data: Any = file.data
    elif isinstance(file, dict):
        return _names_in(file['file'])
    else:
        data = read_file(str(file.value if isinstance(file, Computed) else file))
    if data is None:
        return _EveryName()
    return set(_flat(data, ''))


class _EveryName(set[str]):
    """The names in a file that nobody has read."""

    def __rand__(self, other: Any) -> set[str]:
        return set(other)


def _flat(data: Any, prefix: str) -> Iterable[str]:
    if not isinstance(data, dict):
        yield prefix
        return
    for key, value in data.items():
        # What stands above `ros__parameters` are names of nodes.
        yield from _flat(value, '' if key == 'ros__parameters' else f'{prefix}.{key}'.strip('.'))
