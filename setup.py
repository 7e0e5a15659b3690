"""Build Composer as a ROS package: colcon reads this file, pip does not."""

import tomllib
from pathlib import Path
from typing import Any

from setuptools import Distribution, setup

SHARE = 'share/rclpy_composer'
# With `--symlink-install`, this file is a link.
SOURCE = Path(__file__).resolve().with_name('pyproject.toml')
PROJECT = tomllib.loads(SOURCE.read_text(encoding='utf-8'))['project']
# Where colcon links the sources, the schemas are beside them.
SCHEMAS = ['composer.schemas'] if Path('schemas').is_dir() else []
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
    packages=['behaviours', 'composer', *SCHEMAS],
    package_dir={'composer.schemas': 'schemas'},
    # Some folders of examples have names that no package can have.
    package_data={'': ['*'], 'composer': ['**/*']},
    exclude_package_data={'': ['*.pyc']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/rclpy_composer']),
        (SHARE, ['package.xml']),
        (f'{SHARE}/systems', ['configs/greeter.yaml', 'configs/talker_listener.yaml']),
    ],
    zip_safe=False,
)
