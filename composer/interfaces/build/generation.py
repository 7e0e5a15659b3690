"""Generate the sources of an interface package with ROS's own generators.

This is a program, run as `generation.py ARGUMENTS.json`, that imports nothing of Composer: the
generators print, replace `sys.stdout` and keep state. It imports once what all of them need, and
then runs each in a fork. `composer.interfaces.build.compilation` writes the
arguments.

Beside the sources of each generator it writes *units* to compile: files that include many sources,
because a compiler reads the headers of ROS once per unit.
"""

import importlib
import json
import os
import sys
import traceback
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

TYPE_SUPPORTS = ('rosidl_typesupport_fastrtps_c', 'rosidl_typesupport_introspection_c')

# Sources that can be joined in one unit; those of descriptions define the same static names.
_JOINED_SUFFIXES = (
    '__functions.c',
    '__type_support.c',
    '__type_support_c.cpp',
    '__type_support.cpp',
    '_s.c',
)


def main(arguments_path: str) -> None:
    """Generate what the arguments list."""
    arguments = json.loads(Path(arguments_path).read_text(encoding='utf-8'))
    _check_template_engine()
    _describe(arguments)
    steps = [partial(_generate, name, arguments) for name in arguments['generators']]
    _run_in_forks(steps, arguments['workers'])


def _run_in_forks(steps: Sequence[Callable[[], None]], workers: int) -> None:
    """Run each step in a fork, a few at a time, and exit if one fails."""
    waiting = list(steps)
    running: set[int] = set()
    failed = False
    while running or (waiting and not failed):
        while waiting and len(running) < workers and not failed:
            running.add(_fork(waiting.pop(0)))
        process, status = os.wait()
        running.discard(process)
        failed = failed or status != 0
    if failed:
        sys.exit(1)


def _fork(step: Callable[[], None]) -> int:
    process = os.fork()
    if process:
        return process
    code = 1
    try:
        step()
        code = 0
    except BaseException:  # noqa: BLE001 (the process ends here)
        traceback.print_exc()
    sys.stdout.flush()
    os._exit(code)


def _check_template_engine() -> None:
    engine = importlib.import_module('em')
    version = getattr(engine, '__version__', 'unknown')
    if not hasattr(engine, 'Interpreter') or version == '4.0':
        sys.exit(
            f'the module em of version {version} ({engine.__file__}) does not fit the generators: '
            "they need empy from 3.3.4, except 4.0; a package called 'em' hides it",
        )


def _describe(arguments: dict[str, Any]) -> None:
    """Translate the definitions to IDL, and compute type descriptions and hashes from that."""
    share = Path(arguments['share'])
    for entry in arguments['interfaces']:
        kind = Path(entry).parent.name
        adapter = importlib.import_module(f'rosidl_adapter.{kind}')
        convert = getattr(adapter, f'convert_{kind}_to_idl')
        source = Path(f'{entry}.{kind}')
        convert(Path(arguments['definitions']), arguments['package'], source, share / kind)
    generator = importlib.import_module('rosidl_generator_type_description')
    path = _write_arguments('rosidl_generator_type_description', arguments, share)
    generator.generate_type_hash(str(path))


def _generate(name: str, arguments: dict[str, Any]) -> None:
    output = Path(arguments['build'], 'sources', name, arguments['package'])
    path = str(_write_arguments(name, arguments, output))
    module = importlib.import_module(name)
    generators: dict[str, Callable[[], list[str]]] = {
        'rosidl_generator_c': lambda: module.generate_c(path),
        'rosidl_typesupport_fastrtps_c': lambda: module.generate_typesupport_fastrtps_c(path),
        'rosidl_typesupport_introspection_c': lambda: module.generate_c(path),
        'rosidl_typesupport_c': lambda: module.generate_c(path, list(TYPE_SUPPORTS)),
        'rosidl_generator_py': lambda: module.generate_py(path, ['rosidl_typesupport_c']),
    }
    generated = [Path(file) for file in generators[name]()]
    _move_headers(output, generated, arguments)
    _write_visibility_header(name, arguments)
    _write_units(name, arguments, [path for path in generated if path.suffix in {'.c', '.cpp'}])
    if name == 'rosidl_generator_py':
        _move_modules(output, Path(arguments['modules']))


def _write_arguments(name: str, arguments: dict[str, Any], output: Path) -> Path:
    """Write the arguments file that a generator expects, as rosidl's CMake functions do."""
    share = arguments['share']
    interfaces = arguments['interfaces']
    path = Path(arguments['build'], f'{name}.json')
    path.write_text(
        json.dumps(
            {
                'package_name': arguments['package'],
                'output_dir': str(output),
                'template_dir': arguments['templates'].get(name, ''),
                'idl_tuples': [f'{share}:{entry}.idl' for entry in interfaces],
                'type_description_tuples': [
                    f'{entry}.idl:{share}/{entry}.json' for entry in interfaces
                ],
                'ros_interface_files': [
                    f'{share}/{entry}.{Path(entry).parent}' for entry in interfaces
                ],
                'ros_interface_dependencies': [],
                'include_paths': [
                    f'{package}:{path}' for package, path in arguments['used'].items()
                ],
                'target_dependencies': [],
            }
        ),
        encoding='utf-8',
    )
    return path


def _move_headers(output: Path, generated: Iterable[Path], arguments: dict[str, Any]) -> None:
    """Move the headers to where packages that use this one find them."""
    for path in generated:
        if path.suffix == '.h':
            target = Path(arguments['include'], path.relative_to(output))
            target.parent.mkdir(parents=True, exist_ok=True)
            path.replace(target)


def _write_visibility_header(name: str, arguments: dict[str, Any]) -> None:
    """Write the header that rosidl has CMake configure."""
    template = Path(arguments['templates'][name], f'{name}__visibility_control.h.in')
    if not template.exists():
        return
    package = arguments['package']
    text = template.read_text(encoding='utf-8')
    text = text.replace('@PROJECT_NAME_UPPER@', package.upper()).replace('@PROJECT_NAME@', package)
    folder = Path(arguments['include'], 'msg')
    folder.mkdir(parents=True, exist_ok=True)
    (folder / template.stem).write_text(text, encoding='utf-8')


def _write_units(name: str, arguments: dict[str, Any], sources: list[Path]) -> None:
    joined = [path for path in sources if path.name.endswith(_JOINED_SUFFIXES)]
    for index, group in enumerate([joined, *([path] for path in sources if path not in joined)]):
        if not group:
            continue
        extension = '.ep.' in group[0].name
        folder = Path(arguments['build'], 'units', 'extension' if extension else name)
        folder.mkdir(parents=True, exist_ok=True)
        unit = folder / f'unit_{index}{group[0].suffix}'
        unit.write_text(''.join(f'#include "{path}"\n' for path in group), encoding='utf-8')


def _move_modules(output: Path, modules: Path) -> None:
    """Move the Python modules to the folder of the Python package."""
    for path in sorted(output.rglob('*.py')):
        target = modules / path.relative_to(output)
        target.parent.mkdir(parents=True, exist_ok=True)
        path.replace(target)
    (modules / '__init__.py').touch()


if __name__ == '__main__':
    main(*sys.argv[1:])
