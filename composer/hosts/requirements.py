"""What a system requires of Python's packages, and wheels of these for a host.

The packages, and their versions, are those that are installed here: what was tested is what runs.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from typing import TYPE_CHECKING

from composer.errors import ComposerError
from composer.input_limits import read_file
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from packaging.requirements import Requirement

_COMPOSER = 'rclpy-composer'
_ROS_EXTRAS = {'ros': 'ros-jazzy-rclpy', 'ros-kilted': 'ros-kilted-rclpy'}
_MACHINES = {'arm64': 'aarch64', 'AMD64': 'x86_64'}
_OLDEST_GLIBC_MINOR = 17


@record
class PlatformSpec:
    """What wheels must fit.

    Attributes:
        python: Major and minor version.
        machine: As `uname -m` says it.
        glibc: Its version, as in `2.36`; empty if it has another C library.
        ros: The distribution of its ROS 2 in /opt/ros; empty for none.
    """

    python: tuple[int, int]
    machine: str
    glibc: str
    ros: str = ''

    @classmethod
    def own(cls) -> PlatformSpec:
        """Return what this computer is."""
        distribution = os.environ.get('ROS_DISTRO', '')
        ros = distribution if Path('/opt/ros', distribution, 'setup.sh').is_file() else ''
        return cls(sys.version_info[:2], platform.machine(), platform.libc_ver()[1], ros)

    @property
    def is_own(self) -> bool:
        """Whether what runs here runs there."""
        return self.python == sys.version_info[:2] and self.machine == platform.machine()

    @property
    def tag(self) -> str:
        """A name for it, as a folder's."""
        return f'cp{self.python[0]}{self.python[1]}-{self.machine}'


def composer_requirements(*, has_ros: bool, builds_interfaces: bool) -> list[str]:
    """Return what Composer itself requires on a host.

    Args:
        has_ros: Whether the host has a ROS 2 of its own.
        builds_interfaces: Whether interface packages are built there.

    Raises:
        ComposerError: The host needs wheels of ROS 2, and none are installed here.
    """
    extras = ['interfaces'] * (builds_interfaces and not has_ros)
    if not has_ros:
        found = [extra for extra, package in _ROS_EXTRAS.items() if _find(package) is not None]
        if not found:
            message = 'the host has no ROS 2 in /opt/ros, and here are no wheels of it to bring'
            advice = "install it there, or here: pip install 'rclpy-composer[ros]'"
            raise ComposerError(message, help=advice)
        extras.append(found[0])
    return [f'{_COMPOSER}[{",".join(extras)}]' if extras else _COMPOSER, 'pip']


def project_requirements(folders: Iterable[Path]) -> list[str]:
    """Return what the projects in these folders require: `requirements.txt`, `pyproject.toml`."""
    found: list[str] = []
    for folder in folders:
        listed = folder / 'requirements.txt'
        if listed.is_file():
            lines = (
                line.split(' #')[0].strip() for line in read_file(listed).decode().splitlines()
            )
            found += [line for line in lines if line and not line.startswith(('#', '-'))]
        found += _read_pyproject(folder / 'pyproject.toml')
    return list(dict.fromkeys(found))


def _read_pyproject(path: Path) -> list[str]:
    import tomllib

    if not path.is_file():
        return []
    project = tomllib.loads(read_file(path).decode()).get('project', {})
    if project.get('name') == _COMPOSER:
        return []
    return [str(each) for each in project.get('dependencies', ())]


def pin(requirements: Sequence[str], target: PlatformSpec) -> list[str]:
    """Return the packages that these need, with the versions that are installed here.

    Raises:
        ComposerError: One is not installed here.
    """
    pins: dict[str, str] = {}
    seen: set[tuple[str, frozenset[str]]] = set()
    pending = list(_needed(requirements, (), target))
    while pending:
        requirement = pending.pop()
        name = _normal(requirement.name)
        key = (name, frozenset(requirement.extras))
        if key in seen:
            continue
        seen.add(key)
        found = _find(name)
        if found is None:
            message = f"the host needs '{requirement}', and it is not installed here"
            advice = f"pip install '{requirement}': what runs there is what was tested here"
            raise ComposerError(message, help=advice)
        if name != _COMPOSER:
            pins[name] = found.version
        pending += _needed(found.requires or (), requirement.extras, target)
    return sorted(f'{name}=={version}' for name, version in pins.items())


def _needed(
    texts: Iterable[str], extras: Iterable[str], target: PlatformSpec
) -> Iterator[Requirement]:
    """Yield the requirements that hold for a host."""
    environment = {
        'python_version': '.'.join(map(str, target.python)),
        'python_full_version': f'{target.python[0]}.{target.python[1]}.0',
        'platform_machine': target.machine,
    }
    for each in _parse(texts):
        marker = each.marker
        chosen = ({**environment, 'extra': extra} for extra in ('', *extras))
        if marker is None or any(marker.evaluate(values) for values in chosen):
            yield each


def provide_wheels(pins: Sequence[str], target: PlatformSpec) -> dict[str, Path]:
    """Return a wheel for each package, by its name; those that are missing are fetched or built.

    Raises:
        ComposerError: There is none for the host.
    """
    cache = os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache'
    folder = Path(cache) / 'composer' / 'wheels' / target.tag
    folder.mkdir(parents=True, exist_ok=True)
    known = _list_wheels(folder)
    missing = [each for each in pins if each not in known]
    if missing:
        _fetch(missing, folder, target)
        known = _list_wheels(folder)
    lacking = [each for each in pins if each not in known]
    if lacking:
        message = f'there are no wheels for {target.tag} of {", ".join(lacking)}'
        raise ComposerError(message)
    return {each: known[each] for each in pins}


def _fetch(pins: Sequence[str], folder: Path, target: PlatformSpec) -> None:
    common = ['--no-deps', '--quiet', '--disable-pip-version-check']
    if target.is_own:
        _pip(['wheel', *common, '--wheel-dir', str(folder), *pins], target)
        return
    machine = _MACHINES.get(target.machine, target.machine)
    newest = int((target.glibc or '2.17').split('.')[1])
    minors = range(newest, _OLDEST_GLIBC_MINOR - 1, -1)
    platforms = [f'--platform=manylinux_2_{minor}_{machine}' for minor in minors]
    platforms += [f'--platform=manylinux2014_{machine}', f'--platform=linux_{machine}']
    python = ''.join(map(str, target.python))
    words = ['download', *common, '--only-binary=:all:', '--dest', str(folder), *platforms]
    words += [f'--python-version={python}', '--implementation=cp']
    words += [f'--abi=cp{python}', '--abi=abi3', '--abi=none']
    _pip([*words, *pins], target)


def _pip(words: Sequence[str], target: PlatformSpec) -> None:
    done = subprocess.run(  # noqa: S603 - pip of this Python
        [sys.executable, '-m', 'pip', *words],
        check=False,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    if done.returncode:
        errors = [line for line in done.stdout.splitlines() if line.startswith('ERROR')]
        message = f'pip finds no wheels for {target.tag}'
        raise ComposerError(message, help='\n'.join(errors) or done.stdout[-1000:])


def _list_wheels(folder: Path) -> Mapping[str, Path]:
    """Return the wheels in a folder, as in `pyyaml==6.0.3`."""
    found = {}
    for path in folder.glob('*.whl'):
        name, version = path.name.split('-')[:2]
        found[f'{_normal(name)}=={version}'] = path
    return found


def _parse(texts: Iterable[str]) -> Iterator[Requirement]:
    try:
        from packaging.requirements import InvalidRequirement, Requirement
    except ImportError as error:
        message = 'requirements are read by packaging, which is not installed'
        raise ComposerError(message, help="pip install 'rclpy-composer[hosts]'") from error
    for text in texts:
        try:
            yield Requirement(text)
        except InvalidRequirement as error:
            message = f"the project requires '{text}', which is no requirement: {error}"
            raise ComposerError(message) from error


def _find(name: str) -> Distribution | None:
    try:
        return distribution(name)
    except PackageNotFoundError:
        return None


def _normal(name: str) -> str:
    return re.sub(r'[-_.]+', '-', name).lower()
