"""Each package that make installs has one version, so that a clone is the same next month."""

import os
import re
import subprocess
import tomllib
from itertools import chain
from xml.etree import ElementTree as ET

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.running import ROOT

PROJECT = tomllib.loads((ROOT / 'pyproject.toml').read_text())['project']
OTHERS = {'jazzy': 'ros-kilted', 'kilted': 'ros-jazzy'}


@pytest.mark.parametrize('ros', OTHERS)
def test_all_that_is_required_has_a_version_in_the_range_for_users(ros):
    lines = (ROOT / 'constraints' / f'{ros}.txt').read_text().splitlines()
    assert [line for line in lines if not re.fullmatch(r'[\w.-]+==[\w.]+', line)] == []
    versions = {
        canonicalize_name(name): version for name, version in (line.split('==') for line in lines)
    }
    assert len(versions) == len(lines)
    extras = PROJECT['optional-dependencies'].values()
    texts = [*PROJECT['dependencies'], *chain.from_iterable(extras)]
    for requirement in map(Requirement, texts):
        if not requirement.name.startswith(OTHERS[ros]):
            version = versions[canonicalize_name(requirement.name)]
            assert version in requirement.specifier, requirement


@pytest.mark.parametrize(
    ('distro', 'machine', 'said'),
    [
        (
            'humble',
            'x86_64',
            'error: ROS 2 humble is sourced, which is too old: use Jazzy or later',
        ),
        ('', 'aarch64', 'error: there are no wheels of ROS 2 for aarch64'),
    ],
)
def test_make_says_where_no_ros_can_be_used(tmp_path, distro, machine, said):
    uname = tmp_path / 'uname'
    uname.write_text(f'#!/bin/sh\necho {machine}\n')
    uname.chmod(0o755)
    environment = {'PATH': f'{tmp_path}:{os.environ["PATH"]}', 'ROS_DISTRO': distro}
    words = ['make', '-s', '-C', str(ROOT), f'VENV={tmp_path}/venv', 'up']
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.splitlines()[0] == said
    assert not (tmp_path / 'venv').exists()


def test_the_ros_package_has_the_version_and_the_dependencies_of_the_project():
    package = ET.parse(ROOT / 'package.xml').getroot()
    recipe = yaml.safe_load((ROOT / 'packaging/robostack/recipe.yaml').read_text())
    versions = {package.findtext('version'), recipe['package']['version']}
    assert versions == {PROJECT['version']}
    required = {canonicalize_name(Requirement(text).name) for text in PROJECT['dependencies']}
    keys = {key.text.removeprefix('python3-') for key in package.iter('exec_depend')}
    optional = {'jsonschema-rs', 'watchfiles'}
    assert {name.removeprefix('py') for name in required} - keys == optional
    run = {Requirement(text).name for text in recipe['requirements']['run']}
    assert required - run == {'jsonschema-rs'}
