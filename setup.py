"""Build Composer as a ROS package: colcon reads this file, pip does not."""

import tomllib
from pathlib import Path
from typing import Any

from setuptools import Distribution, find_namespace_packages, setup

SHARE = 'share/rclpy_composer'
OWN = ('composer', 'composer.*', 'behaviours')
# With `--symlink-install`, this file is a link.
SOURCE = Path(__file__).resolve().with_name('pyproject.toml')
PROJECT = tomllib.loads(SOURCE.read_text(encoding='utf-8'))['project']
SCRIPTS = {'console_scripts': PROJECT['scripts']}


class RosPackage(Distribution):
    """Leaves `pyproject.toml` to this file.

    colcon cannot read the version ranges that setuptools takes from it, and the setuptools of
    Ubuntu 24.04 cannot read its license.
    """

    def parse_config_files(self, filenames: Any = None, **options: Any) -> None:
        """Read all files of settings but `pyproject.toml`."""
        super().parse_config_files(filenames or self.find_config_files(), **options)


setup(
    distclass=RosPackage,
    name=PROJECT['name'],
    version=PROJECT['version'],
    description=PROJECT['description'],
    license=PROJECT['license'],
    entry_points={
        group: [f'{name} = {place}' for name, place in places.items()]
        for group, places in (SCRIPTS | PROJECT['entry-points']).items()
    },
    # Folders of data are packages, too: all of their files are installed.
    packages=[
        *find_namespace_packages(include=OWN, exclude=['*__pycache__']),
        # Linked sources have the schemas beside them.
        *(['composer.schemas'] if Path('schemas').is_dir() else []),
    ],
    package_dir={'composer.schemas': 'schemas'},
    package_data={'': ['*']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/rclpy_composer']),
        (SHARE, ['package.xml']),
        (f'{SHARE}/systems', ['configs/greeter.yaml', 'configs/talker_listener.yaml']),
    ],
    zip_safe=False,
)
