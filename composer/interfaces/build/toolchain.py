"""Find the compilers, generators and headers for a build, or report all that are missing."""

import os
import shlex
import shutil
import sysconfig
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

from composer.ament import find_path
from composer.errors import ComposerError
from composer.records import record

# In the order of their work; the last five write sources that are compiled.
GENERATORS = (
    'rosidl_generator_type_description',
    'rosidl_generator_c',
    'rosidl_typesupport_fastrtps_c',
    'rosidl_typesupport_introspection_c',
    'rosidl_typesupport_c',
    'rosidl_generator_py',
)
_MODULES = ('em', 'lark', 'rosidl_adapter', 'rosidl_parser', 'rosidl_pycommon', *GENERATORS)
_COMPILERS = {'CC': ('gcc', 'cc', 'clang'), 'CXX': ('g++', 'c++', 'clang++')}


class BuildToolsMissingError(ComposerError):
    """Interface packages cannot be built with what is installed.

    Attributes:
        missing: what is missing, such as `C++ compiler`.
    """

    def __init__(self, missing: Sequence[str], advice: Sequence[str]) -> None:
        """List what is missing, and what to install."""
        super().__init__(
            f'interface packages cannot be built: there is no {", no ".join(missing)}',
            help='; '.join(dict.fromkeys(advice)),
        )
        self.missing = tuple(missing)


@record
class Toolchain:
    """The programs and files to build with.

    Attributes:
        c: the C compiler, with the arguments in `CC`.
        cxx: the C++ compiler, likewise.
        templates: the folder of each generator's templates, by its name.
        python_includes: folders with the headers of Python and NumPy.
        prefixes: where ROS is installed.
    """

    c: tuple[str, ...]
    cxx: tuple[str, ...]
    templates: Mapping[str, Path]
    python_includes: tuple[Path, ...]
    prefixes: tuple[Path, ...]


def find_toolchain(prefixes: Sequence[Path]) -> Toolchain:
    """Find what a build needs.

    The environment variables `CC` and `CXX` name other compilers.

    Args:
        prefixes: where ROS is installed.

    Raises:
        BuildToolsMissingError: something is missing; the error lists all of it.
    """
    compilers = {variable: _find_compiler(variable) for variable in _COMPILERS}
    templates = {name: find_path(f'share/{name}/resource', prefixes) for name in GENERATORS}
    includes = {'Python.h': _python_include(), 'numpy/arrayobject.h': _numpy_include()}
    missing = [
        *_missing_compilers(compilers),
        *_missing_headers(includes),
        *_missing_generators(templates, prefixes),
    ]
    if missing:
        raise BuildToolsMissingError(*zip(*missing, strict=True))
    return Toolchain(
        c=compilers['CC'],
        cxx=compilers['CXX'],
        templates={name: path for name, path in templates.items() if path is not None},
        python_includes=tuple(includes.values()),
        prefixes=tuple(prefixes),
    )


def _find_compiler(variable: str) -> tuple[str, ...]:
    """Find a compiler; `CC` may hold arguments, as in `ccache gcc`."""
    named = os.environ.get(variable)
    commands = [shlex.split(named)] if named else [[name] for name in _COMPILERS[variable]]
    for program, *arguments in commands:
        path = shutil.which(program)
        if path:
            return (path, *arguments)
    return ()


def _missing_compilers(compilers: Mapping[str, tuple[str, ...]]) -> Iterator[tuple[str, str]]:
    for variable, language in (('CC', 'C'), ('CXX', 'C++')):
        if compilers[variable]:
            continue
        named = os.environ.get(variable)
        if named:
            yield f'{language} compiler {named!r}', f'{variable} names it: correct or unset it'
        else:
            yield f'{language} compiler', 'install gcc and g++ (Debian, Ubuntu: apt install g++)'


def _missing_headers(includes: Mapping[str, Path]) -> Iterator[tuple[str, str]]:
    for header, folder in includes.items():
        if (folder / header).is_file():
            continue
        if header == 'Python.h':
            yield (
                f'Python.h in {folder}',
                "install Python's headers (Debian, Ubuntu: apt install python3-dev)",
            )
        else:
            yield header, 'install NumPy: pip install numpy'


def _missing_generators(
    templates: Mapping[str, Path | None],
    prefixes: Sequence[Path],
) -> Iterator[tuple[str, str]]:
    modules = [name for name in _MODULES if find_spec(name) is None]
    folders = [name for name, path in templates.items() if path is None and name not in modules]
    headers = find_path('include/rosidl_runtime_c', prefixes)
    if modules or folders:
        names = [*modules, *(f'{name} in share' for name in folders)]
        advice = (
            "pip install 'rclpy-composer[interfaces]', or where ROS comes from apt, install "
            'ros-$ROS_DISTRO-rosidl-default-generators and source its setup file'
        )
        yield f'complete set of generators (missing: {", ".join(names)})', advice
    elif headers is None:
        yield 'rosidl_runtime_c header', 'install ROS with its development files'


def _python_include() -> Path:
    return Path(sysconfig.get_path('include'))


def _numpy_include() -> Path:
    """Find the headers without importing NumPy, which takes long; NumPy 2 moved them."""
    spec = find_spec('numpy')
    package = Path(spec.origin or '').parent if spec else Path('numpy')
    new = package / '_core' / 'include'
    return new if new.is_dir() else package / 'core' / 'include'
