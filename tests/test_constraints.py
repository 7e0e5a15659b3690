"""Each package that make installs has one version, so that a clone is the same next month."""

import re
import tomllib
from itertools import chain

import pytest
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
