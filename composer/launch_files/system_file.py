"""What a launch file consists of → the text of a system, and the parameter files beside it."""

from __future__ import annotations

import re
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

from composer.launch_files.parameters import NewFile
from composer.launch_files.texts import Computed, Text
from composer.terminal import escape
from composer.yaml_text.writer import RCL, render_yaml

if TYPE_CHECKING:
    from composer.launch_files.results import Argument, Entry, Imported, Origin

_FIXED = 'Fixed by the import. For another value:'
_SECTIONS = ('processes', 'containers')
_NEW_FILE = re.compile(rf'{re.escape(tempfile.gettempdir())}/[\w./-]+')
_NAME = re.compile(r'[^A-Za-z0-9_.-]+')


@dataclass
class SystemFile:
    """The text of a system, and the files beside it by their paths relative to it.

    Attributes:
        origins: Where its entries are from, by the lines in which they begin.
    """

    text: str = ''
    files: dict[str, str] = field(default_factory=dict)
    origins: dict[int, Origin] = field(default_factory=dict)


def render_system(imported: Imported, source: Path, output: Path | None = None) -> SystemFile:
    """Return an imported launch file as a system.

    Args:
        source: The launch file.
        output: Where it is to stand: paths below that folder are written as `{{ here }}/…`.
    """
    stem = output.stem if output else source.name.partition('.')[0]
    # Not `resolve`: launch leaves links in its paths.
    folder = str(output.parent.absolute()) if output else None
    written = SystemFile()
    lines = _head(imported, source, output)
    common = _common_environment(imported.entries)
    if common:
        lines += ['', render_yaml({'environment': common}).rstrip()]
    for section in _SECTIONS:
        entries = [entry for entry in imported.entries if entry.section == section]
        if entries:
            lines += ['', f'{section}:']
        for entry in entries:
            data = _finished(imported, entry, common, written, stem)
            data = _from_here(_Copies(imported, written, f'{stem}.files').of(data), folder)
            written.origins[len(lines) + 1] = entry.origin
            lines += [f'  # {_one_line(entry.origin)}'] if entry.origin else []
            lines += [f'  {line}' for line in render_yaml({entry.name: data}).splitlines()]
    if not imported.entries:
        lines += ['', 'nodes: {}']
    if imported.remarks:
        lines += ['', '# Not kept as it was:']
        lines += [f'# {_one_line(remark)}' for remark in imported.remarks]
    written.text = '\n'.join(lines) + '\n'
    return written


def _head(imported: Imported, source: Path, output: Path | None) -> list[str]:
    lines = [f'# Imported from {_one_line(source.name)}.', 'version: 1']
    lines += ['', 'args:'] if imported.arguments else []
    for argument in imported.arguments.values():
        data = _declaration(argument, is_given=argument.name in imported.given)
        if argument.fixed:
            words = [
                f'{name}:={text}' for name, text in imported.given.items() if name != argument.name
            ]
            target = ['-o', str(output)] if output else []
            command = [
                'composer',
                'import',
                str(source),
                *words,
                f'{argument.name}:=VALUE',
                *target,
            ]
            text = f'{_FIXED} {" ".join(map(quote, command))}'
            data['description'] = f'{data.get("description", "")} {text}'.strip()
        lines += [f'  {line}' for line in render_yaml({argument.name: data}).splitlines()]
    return lines


def _one_line(text: str) -> str:
    """Return a text for a comment, without the characters that YAML does not allow."""
    return escape(' '.join(text.split()))


def _declaration(argument: Argument, *, is_given: bool) -> dict[str, Any]:
    data: dict[str, Any] = {'type': 'string'}
    if argument.fixed and (is_given or argument.default is None):
        data['default'] = argument.given
    elif argument.default is not None:
        data['default'] = argument.default.written()
    if argument.description:
        data['description'] = ' '.join(argument.description.split())
    if argument.fixed:
        data['choices'] = [data['default']]
    elif argument.choices:
        data['choices'] = list(argument.choices)
    return data


def _common_environment(entries: list[Entry]) -> dict[str, Any]:
    """Return the variables that are the same for all processes."""
    if not entries:
        return {}
    first, *others = [entry.environment for entry in entries]
    return {
        name: value.written()
        for name, value in first.items()
        if value is not None and all(name in each and each[name] == value for each in others)
    }


def _finished(
    imported: Imported, entry: Entry, common: dict[str, Any], written: SystemFile, stem: str
) -> dict[str, Any]:
    """Return the data of an entry as they are written."""
    data: dict[str, Any] = {}
    if entry.when:
        data['when'] = Computed(f'{{{{ {entry.when} }}}}', entry.holds)
    data |= entry.data
    if 'components' in data:
        # The entry may be written once more, with its parameter files as they are in it.
        data['components'] = {label: {**each} for label, each in data['components'].items()}
    if entry.section == 'containers' and entry.action is None:
        # A container that runs already is needed while there are components for it.
        codes = dict.fromkeys(each.get('when') for each in data['components'].values())
        if codes and None not in codes:
            terms = ' or '.join(f'({code[3:-3]})' for code in codes if code)
            data = {'when': Computed(f'{{{{ {terms} }}}}', entry.holds), **data}
    env = {
        name: value.written()
        for name, value in entry.environment.items()
        if name not in common and isinstance(value, Text)
    }
    if env:
        data['env'] = env | data.get('env', {})
    for owner, node in _with_files(data):
        owner['parameter_files'] = [
            _written_file(each, node, written, stem) for each in owner['parameter_files']
        ]
    waits = list(_waits(imported, entry))
    if waits:
        data['wait_for'] = waits[0] if len(waits) == 1 else waits
    return data


@dataclass
class _Copies:
    """Copies files that the launch file has written, and that would be gone, beside the system.

    Attributes:
        folder: Where to, relative to the system.
    """

    imported: Imported
    written: SystemFile
    folder: str

    def of(self, data: Any) -> Any:
        """Return data with the paths of the copies in it."""
        if isinstance(data, dict):
            return {key: self.of(value) for key, value in data.items()}
        if isinstance(data, list):
            return [self.of(value) for value in data]
        if not isinstance(data, str):
            return data
        text = _NEW_FILE.sub(self._copied, data)
        value = data.value if isinstance(data, Computed) else data
        return data if text == data else Computed(text, value)

    def _copied(self, found: re.Match[str]) -> str:
        path = Path(found[0])
        if not self.imported.is_new_file(str(path)):
            return found[0]
        try:
            content = path.read_text(encoding='utf-8')
        except ValueError:
            self.imported.remarks.append(f"'{path}' was written by the import: keep a copy of it")
            return found[0]
        name = f'{self.folder}/{path.name}'
        self.written.files[name] = content
        return f'{{{{ here }}}}/{name}'


def _from_here(data: Any, folder: str | None) -> Any:
    """Return data with paths below a folder as the file there writes them."""
    if isinstance(data, dict):
        return {key: _from_here(value, folder) for key, value in data.items()}
    if isinstance(data, list):
        return [_from_here(value, folder) for value in data]
    if isinstance(data, Computed) and folder is not None:
        # The first of the parts of a path.
        text = re.sub(rf"^({{{{ (?:\(\[)+)'{re.escape(folder)}(?=[/'])", r"\1here ~ '", data)
        if text != data:
            return Computed(text.replace(" ~ ''", ''), data.value)
    is_path = isinstance(data, str) and folder is not None and data.startswith(f'{folder}/')
    if not is_path or (not isinstance(data, Computed) and '{' in data):
        return data
    value = data.value if isinstance(data, Computed) else data
    return Computed('{{ here }}' + data[len(str(folder)) :], value)


def _with_files(data: dict[str, Any]) -> Any:
    """Yield what has parameter files, each with the name of its node, if that is known."""
    if 'parameter_files' in data:
        yield data, data.get('name')
    for label, component in data.get('components', {}).items():
        if 'parameter_files' in component:
            yield component, label


def _written_file(file: Any, node: str | None, written: SystemFile, stem: str) -> Any:
    if not isinstance(file, NewFile):
        return file
    data = file.data
    if not any(
        isinstance(value, dict) and 'ros__parameters' in str(value) for value in data.values()
    ):
        # As launch does: what is for a node of this name comes after what is for all.
        data = {_pattern(node): {'ros__parameters': data}}
    text = render_yaml(data, RCL)
    label = node.value if isinstance(node, Computed) else node
    plain = _NAME.sub('_', label or '').strip('_') or 'node'
    number, path = 2, f'{stem}.params/{plain}.yaml'
    while path in written.files and written.files[path] != text:
        path, number = f'{stem}.params/{plain}_{number}.yaml', number + 1
    written.files[path] = text
    given: dict[str, Any] = {'file': path}
    given |= {'expressions': True} if _has_expressions(data) else {}
    given |= {'root': file.root} if file.root else {}
    return given if len(given) > 1 else path


def _pattern(node: str | None) -> str:
    if isinstance(node, Computed):
        return Computed(f'/**/{node}', f'/**/{node.value}')
    return f'/**/{node}' if node else '/**'


def _has_expressions(data: Any) -> bool:
    if isinstance(data, dict):
        return any(_has_expressions(each) for each in (*data.keys(), *data.values()))
    if isinstance(data, list):
        return any(map(_has_expressions, data))
    return isinstance(data, Computed)


def _waits(imported: Imported, entry: Entry) -> Any:
    for wait in entry.waits:
        target = next((each for each in imported.entries if each.action is wait.action), None)
        if target is None:
            imported.remarks.append(f"'{entry.name}' waits for what is not among the processes")
        elif target.section == 'containers':
            yield {'node': f'/{target.name}'}
        elif wait.state == 'running':
            yield {'process': target.name}
        else:
            yield {'process': target.name, 'state': wait.state}
