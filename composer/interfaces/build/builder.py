"""Build an interface package with ROS's generators and the system's compilers, without CMake.

The result is like an installed package: its libraries have sonames and find each other by
`$ORIGIN`, so it can be imported by a running process, without `LD_LIBRARY_PATH` and without a
restart.
"""

import errno
import json
import os
import py_compile
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from composer.ament import INTERFACE_INDEX, PACKAGE_INDEX, find_package
from composer.errors import ComposerError
from composer.input_limits import UnreadableFileError, read_file
from composer.interfaces.build.build_cache import FULL
from composer.interfaces.build.compilation import BuildPlan, plan_jobs, write_generation_arguments
from composer.interfaces.build.jobs import JobError, run_jobs
from composer.interfaces.build.toolchain import find_toolchain
from composer.interfaces.definitions.package_folder import PackageDefinitions
from composer.interfaces.definitions.packages import used_packages
from composer.records import record

_SHOWN_LINES = 20
# With less space left on a disk, a program that failed may have failed for that: not all say so.
_LEAST_BYTES = 1 << 20

_PACKAGE_XML = """\
<?xml version="1.0"?>
<package format="3">
  <name>{package}</name>
  <version>0.0.0</version>
  <description>Built by Composer.</description>
  <maintainer email="nobody@localhost">nobody</maintainer>
  <license>unknown</license>
{depends}  <member_of_group>rosidl_interface_packages</member_of_group>
</package>
"""


class BuildError(ComposerError):
    """A generator or a compiler failed on definitions that look right.

    Attributes:
        output: all its output.
    """

    def __init__(self, package: str, error: JobError) -> None:
        """Show the lines with errors in the output, or its last lines."""
        lines = error.output.strip().splitlines()
        shown = [line for line in lines if 'error' in line.lower()] or lines
        text = '\n'.join(f'  {line}' for line in shown[-_SHOWN_LINES:])
        super().__init__(
            f'{package} could not be built: {error}\n{text}',
            help='the definitions have no errors, so the cause may be the installed generators '
            'or compilers, or Composer itself',
        )
        self.output = error.output


class DependencyMissingError(ComposerError):
    """An interface package that every service or action needs is not installed."""


@record
class Dependencies:
    """The packages that a package is built on.

    Attributes:
        prefixes: where ROS is installed.
        built: the prefixes of packages that were built before, by name.
    """

    prefixes: Sequence[Path]
    built: Mapping[str, Path]

    def locate(self, package: str) -> Path:
        """Return the prefix of a package that definitions use.

        Raises:
            DependencyMissingError: it is not there.
        """
        place = self.built.get(package) or find_package(package, self.prefixes, INTERFACE_INDEX)
        if place is None:
            message = f'the interface package {package!r} is not installed'
            release = f'ros-$ROS_DISTRO-{package.replace("_", "-")}'
            advice = f'install it with ROS: {release} from apt, or its wheel'
            raise DependencyMissingError(message, help=advice)
        return place


def build_package(
    definitions: PackageDefinitions,
    prefix: Path,
    dependencies: Dependencies,
    *,
    descriptors: Sequence[int] = (),
) -> None:
    """Build a package into an empty folder.

    Args:
        definitions: without errors.
        prefix: becomes the package's prefix; it may be moved afterwards, together with those of
            `dependencies.built`, which have to lie beside it.
        dependencies: the packages that it uses.
        descriptors: open files that the programs inherit: a lock that must not end before them.

    Raises:
        BuildToolsMissingError: the system lacks something.
        DependencyMissingError: a used package is not installed.
        BuildError: a program failed.
        OSError: a file cannot be written; with `ENOSPC` also if a program failed for that.
    """
    toolchain = find_toolchain(dependencies.prefixes)
    names = sorted(_all_used(definitions, dependencies))
    used = {name: dependencies.locate(name) for name in names}
    plan = BuildPlan(
        package=definitions.package,
        prefix=prefix,
        interfaces=tuple(source.rpartition('.')[0] for source in definitions.sources),
        used=used,
        siblings={name: path for name, path in dependencies.built.items() if name in used},
        toolchain=toolchain,
        workers=max(2, len(os.sched_getaffinity(0))),
    )
    _write_definitions(definitions, plan)
    write_generation_arguments(plan)
    try:
        run_jobs(
            plan_jobs(plan),
            workers=plan.workers,
            environment={
                **os.environ,
                'LC_ALL': 'C.UTF-8',
                'PYTHONHASHSEED': '0',
                # What killed compilers leave is removed with the folder.
                'TMPDIR': str(plan.build),
            },
            descriptors=descriptors,
        )
    except JobError as error:
        if _is_full(prefix, error.output):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)) from error
        raise BuildError(definitions.package, error) from error
    _write_index(plan)
    _write_package_xml(plan, used_packages(definitions))
    _compile_modules(plan)
    shutil.rmtree(plan.build)


def _all_used(definitions: PackageDefinitions, dependencies: Dependencies) -> set[str]:
    """Return the packages whose headers are needed: those used, and those that these use."""
    found = set(used_packages(definitions))
    for message in {reference.message for reference in definitions.references}:
        package, _, name = message.partition('/')
        if package != definitions.package:
            path = dependencies.locate(package) / 'share' / package / 'msg' / f'{name}.json'
            try:
                document = json.loads(read_file(path))
            except (UnreadableFileError, ValueError, RecursionError) as error:
                problem = f"'{path}' cannot be used: {error}"
                raise ComposerError(problem) from error
            described = document['type_description_msg']['referenced_type_descriptions']
            found |= {each['type_name'].partition('/')[0] for each in described}
    return found


def _write_definitions(definitions: PackageDefinitions, plan: BuildPlan) -> None:
    """Write the definitions as they were read, for people, and without comments, for rosidl.

    `rosidl_adapter` cannot translate every comment: one with a backslash makes it fail.
    """
    for source, text in definitions.sources.items():
        bare = '\n'.join(line.partition('#')[0].rstrip() for line in text.splitlines())
        for folder, content in (
            (plan.prefix / 'share' / plan.package, text),
            (plan.build / 'definitions', f'{bare}\n'),
        ):
            path = folder / source
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content, encoding='utf-8')


def _is_full(prefix: Path, output: str) -> bool:
    """Return whether a program failed because a disk is full."""
    disk = os.statvfs(prefix)
    has_no_files = disk.f_files and not disk.f_favail
    is_named = any(os.strerror(number) in output for number in FULL)
    return bool(is_named or has_no_files or disk.f_bavail * disk.f_frsize < _LEAST_BYTES)


def _write_index(plan: BuildPlan) -> None:
    """Enter the package into its prefix's resource index, by which it is found."""
    packages, index = plan.prefix / PACKAGE_INDEX, plan.prefix / INTERFACE_INDEX
    packages.mkdir(parents=True)
    (packages / plan.package).touch()
    index.mkdir(parents=True)
    entries = [
        f'{name}.{suffix}'
        for name in plan.interfaces
        for suffix in ('idl', name.partition('/')[0])
    ]
    (index / plan.package).write_text('\n'.join(entries), encoding='utf-8')


def _write_package_xml(plan: BuildPlan, used: Iterable[str]) -> None:
    """Write the manifest of a ROS package."""
    depends = ''.join(f'  <depend>{name}</depend>\n' for name in sorted(used))
    text = _PACKAGE_XML.format(package=plan.package, depends=depends)
    path = plan.prefix / 'share' / plan.package / 'package.xml'
    path.write_text(text, encoding='utf-8')


def _compile_modules(plan: BuildPlan) -> None:
    """Compile the Python modules, since nothing is written into the package later."""
    mode = py_compile.PycInvalidationMode.UNCHECKED_HASH
    for path in sorted(plan.modules.rglob('*.py')):
        py_compile.compile(str(path), doraise=True, invalidation_mode=mode)
