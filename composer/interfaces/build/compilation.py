"""The jobs that generate, compile and link an interface package.

One program generates all sources; the compilers run in parallel, and the libraries are linked in
the order in which they use each other. A package is laid out as a ROS prefix: `share/`,
`include/`, `lib/`, and `python/` with the modules.
"""

import json
import sys
from collections.abc import Mapping
from pathlib import Path

from composer.ament import find_path
from composer.interfaces.build import generation
from composer.interfaces.build.jobs import Job
from composer.interfaces.build.toolchain import Toolchain
from composer.records import record

# -w: nobody can fix warnings in generated code. NDEBUG leaves out comparisons of constants.
_COMPILE_FLAGS = ('-fPIC', '-O1', '-w', '-pipe', '-DNDEBUG')
_LINK_FLAGS = ('-shared', '-Wl,--no-as-needed')

# Packages whose headers the generated sources include beside those of used interface packages.
_HEADER_PACKAGES = (
    'rcutils',
    'rcpputils',
    'rmw',
    'rosidl_runtime_c',
    'rosidl_runtime_cpp',
    'rosidl_typesupport_c',
    'rosidl_typesupport_interface',
    'rosidl_typesupport_fastrtps_c',
    'rosidl_typesupport_fastrtps_cpp',
    'rosidl_typesupport_introspection_c',
    'rosidl_dynamic_typesupport',
    'fastcdr',
)


@record
class Library:
    """A library of an interface package.

    Attributes:
        generator: that writes its sources and names it.
        language: `c` or `c++`.
        uses: the package's other libraries that it is linked with.
        installed: libraries of ROS that it is linked with.
    """

    generator: str
    language: str
    uses: tuple[str, ...]
    installed: tuple[str, ...]


LIBRARIES = (
    Library('rosidl_generator_c', 'c', (), ('rosidl_runtime_c', 'rcutils')),
    Library(
        'rosidl_typesupport_fastrtps_c',
        'c++',
        ('rosidl_generator_c',),
        (
            'rosidl_typesupport_fastrtps_c',
            'rosidl_typesupport_fastrtps_cpp',
            'fastcdr',
            'rmw',
            'rosidl_runtime_c',
            'rcutils',
        ),
    ),
    Library(
        'rosidl_typesupport_introspection_c',
        'c',
        ('rosidl_generator_c',),
        ('rosidl_typesupport_introspection_c', 'rosidl_runtime_c', 'rcutils'),
    ),
    # Linking the two type supports loads them, and rosidl_typesupport_c finds them by name.
    Library(
        'rosidl_typesupport_c',
        'c++',
        (
            'rosidl_generator_c',
            'rosidl_typesupport_fastrtps_c',
            'rosidl_typesupport_introspection_c',
        ),
        ('rosidl_typesupport_c', 'rosidl_runtime_c', 'rcutils'),
    ),
    Library(
        'rosidl_generator_py',
        'c',
        ('rosidl_generator_c', 'rosidl_typesupport_c'),
        ('rosidl_runtime_c', 'rcutils'),
    ),
)
# The slowest first, to keep all workers busy until the end.
_GENERATION_ORDER = (
    'rosidl_generator_py',
    'rosidl_typesupport_fastrtps_c',
    'rosidl_generator_c',
    'rosidl_typesupport_introspection_c',
    'rosidl_typesupport_c',
)
_EXTENSION = Library(
    'extension',
    'c',
    ('rosidl_generator_py', 'rosidl_typesupport_c', 'rosidl_generator_c'),
    ('rosidl_runtime_c', 'rmw', 'rcutils'),
)


@record
class BuildPlan:
    """What to build, and where.

    Attributes:
        package: its name.
        prefix: the folder that becomes the package's prefix; `definitions/` in `build/` and
            `share/<package>/` hold its definition files already.
        interfaces: such as `msg/Name`.
        used: the prefix of each interface package that this one uses.
        siblings: those of `used` that were built too, which end up beside this one.
        toolchain: the programs and files to build with.
        workers: the number of programs that run at a time.
    """

    package: str
    prefix: Path
    interfaces: tuple[str, ...]
    used: Mapping[str, Path]
    siblings: Mapping[str, Path]
    toolchain: Toolchain
    workers: int

    @property
    def build(self) -> Path:
        """The folder for intermediate files."""
        return self.prefix / 'build'

    @property
    def modules(self) -> Path:
        """The Python package's folder."""
        return self.prefix / 'python' / self.package

    def library(self, generator: str) -> Path:
        """The file of one of the libraries."""
        if generator == 'extension':
            return self.modules / f'{self.package}_s__rosidl_typesupport_c.so'
        return self.prefix / 'lib' / f'lib{self.package}__{generator}.so'


def plan_jobs(plan: BuildPlan) -> list[Job]:
    """Return the jobs of a build."""
    libraries = (*LIBRARIES, _EXTENSION)
    compile_all = [_compile_job(plan, library) for library in libraries]
    link_all = [_link_job(plan, library) for library in libraries]
    return [_generation_job(plan), *compile_all, *link_all]


def write_generation_arguments(plan: BuildPlan) -> None:
    """Write the file that `generation` reads."""
    plan.build.mkdir(parents=True, exist_ok=True)
    _arguments_path(plan).write_text(
        json.dumps(
            {
                'package': plan.package,
                'interfaces': plan.interfaces,
                'definitions': str(plan.build / 'definitions'),
                'share': str(plan.prefix / 'share' / plan.package),
                'include': str(plan.prefix / 'include' / plan.package / plan.package),
                'modules': str(plan.modules),
                'build': str(plan.build),
                'generators': _GENERATION_ORDER,
                'workers': plan.workers,
                'templates': {name: str(path) for name, path in plan.toolchain.templates.items()},
                'used': {name: str(prefix / 'share' / name) for name, prefix in plan.used.items()},
            }
        ),
        encoding='utf-8',
    )


def _arguments_path(plan: BuildPlan) -> Path:
    return plan.build / 'arguments.json'


def _generation_job(plan: BuildPlan) -> Job:
    # -P: the folder of this program must not hide modules of the generators.
    command = [sys.executable, '-P', str(generation.__file__), str(_arguments_path(plan))]
    # Relative entries of PYTHONPATH depend on the current folder.
    return Job('generate', lambda: command, Path.cwd())


def _compile_job(plan: BuildPlan, library: Library) -> Job:
    objects = plan.build / 'objects' / library.generator
    objects.mkdir(parents=True)
    includes = [f'-I{folder}' for folder in _include_folders(plan, library)]

    def command() -> list[str]:
        units = sorted(map(str, (plan.build / 'units' / library.generator).iterdir()))
        return [*_compiler(plan, library), *_COMPILE_FLAGS, *includes, '-c', *units]

    return Job(f'compile {library.generator}', command, objects, ('generate',))


def _include_folders(plan: BuildPlan, library: Library) -> list[Path]:
    folders = [plan.prefix / 'include' / plan.package]
    folders += [prefix / 'include' / name for name, prefix in plan.used.items()]
    prefixes = plan.toolchain.prefixes
    found = (find_path(f'include/{name}', prefixes) for name in _HEADER_PACKAGES)
    folders += [path for path in found if path is not None]
    folders += [prefix / 'include' for prefix in prefixes]
    if library.generator in {'rosidl_generator_py', 'extension'}:
        folders += plan.toolchain.python_includes
    return folders


def _link_job(plan: BuildPlan, library: Library) -> Job:
    target = plan.library(library.generator)
    target.parent.mkdir(parents=True, exist_ok=True)
    objects = plan.build / 'objects' / library.generator
    flags = [*_LINK_FLAGS, f'-Wl,-soname,{target.name}', *_runtime_paths(plan, library)]
    if library.generator not in {'rosidl_generator_py', 'extension'}:
        # Python resolves the symbols of the others.
        flags.append('-Wl,-z,defs')
    libraries = _linked_libraries(plan, library)

    def command() -> list[str]:
        files = sorted(map(str, objects.iterdir()))
        return [*_compiler(plan, library), *flags, '-o', str(target), *files, *libraries]

    after = (f'compile {library.generator}', *(f'link {name}' for name in library.uses))
    return Job(f'link {library.generator}', command, plan.build, after)


def _runtime_paths(plan: BuildPlan, library: Library) -> list[str]:
    """Return the flags by which the loader finds the libraries that a library uses."""
    up = '../..' if library is _EXTENSION else '..'
    own = '$ORIGIN/../../lib' if library is _EXTENSION else '$ORIGIN'
    beside = [f'$ORIGIN/{up}/../{place.name}/lib' for place in plan.siblings.values()]
    installed = [str(prefix / 'lib') for prefix in plan.toolchain.prefixes]
    return [
        *(f'-Wl,-rpath,{path}' for path in (own, *beside, *installed)),
        *(f'-Wl,-rpath-link,{prefix}/lib' for prefix in plan.used.values()),
    ]


def _linked_libraries(plan: BuildPlan, library: Library) -> list[str]:
    paths = [plan.library(name) for name in library.uses]
    if library is not _EXTENSION:
        # Code for a field that is a message calls the C functions of its structure.
        paths += [
            path
            for name, prefix in plan.used.items()
            for generator in dict.fromkeys((library.generator, 'rosidl_generator_c'))
            if (path := prefix / 'lib' / f'lib{name}__{generator}.so').exists()
        ]
    prefixes = plan.toolchain.prefixes
    found = (find_path(f'lib/lib{name}.so', prefixes) for name in library.installed)
    paths += [path for path in found if path is not None]
    return list(map(str, paths))


def _compiler(plan: BuildPlan, library: Library) -> tuple[str, ...]:
    return plan.toolchain.cxx if library.language == 'c++' else plan.toolchain.c
