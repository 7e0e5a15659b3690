"""Installs the package: colcon reads this file."""

from pathlib import Path

from setuptools import find_packages, setup

NAME = 'my_system'
# All files in these folders are installed in share/my_system.
SHARED = ('systems', 'interfaces', 'test')


def list_shared_files() -> list[tuple[str, list[str]]]:
    """Return each folder of `share/`, and the files that go there."""
    folders: dict[str, list[str]] = {}
    for shared in SHARED:
        for path in sorted(Path(shared).rglob('*.*')):
            if path.is_file() and '__pycache__' not in path.parts:
                folders.setdefault(f'share/{NAME}/{path.parent}', []).append(str(path))
    return [*folders.items()]


setup(
    name=NAME,
    version='0.1.0',
    description='A ROS 2 system for Composer.',
    license='Apache-2.0',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        *list_shared_files(),
    ],
    # By this colcon runs the tests with pytest.
    extras_require={'test': ['pytest']},
    zip_safe=False,
)
