"""What tests of hosts share, as fixtures."""

import pytest

from tests.hosts.deployed import DeployBed, Project


@pytest.fixture(scope='session')
def bed(tmp_path_factory, shared_cache):
    """Return two hosts."""
    with DeployBed(tmp_path_factory.mktemp('bed'), shared_cache) as bed:
        yield bed


@pytest.fixture
def project(bed, tmp_path):
    """Return a project that is deployed already, and may be changed."""
    project = Project(bed, tmp_path / 'duo')
    project.ensure()
    return project
