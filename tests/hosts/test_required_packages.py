"""What a project requires is pinned to what is installed here."""

import sys
from importlib.metadata import version

import pytest

from composer.errors import ComposerError
from composer.hosts.requirements import PlatformSpec, pin, project_requirements

HERE = PlatformSpec(sys.version_info[:2], 'x86_64', '2.36')


def test_what_a_package_needs_is_pinned_with_it():
    assert pin(['Jinja2>=3'], HERE) == [
        f'{name}=={version(name)}' for name in ('jinja2', 'markupsafe')
    ]


def test_markers_are_those_of_the_host():
    old = PlatformSpec((3, 8), 'aarch64', '2.31')
    text = "click; python_version < '3.9' and platform_machine == 'aarch64'"
    assert [each.split('==')[0] for each in pin([text], old)] == ['click']
    assert pin([text], HERE) == []


def test_what_is_not_installed_here_cannot_be_brought():
    with pytest.raises(ComposerError, match="the host needs 'no-such-package>=2', and it is not"):
        pin(['no-such-package>=2'], HERE)


@pytest.mark.parametrize('text', ['a b', '-e .', '==1'])
def test_what_is_no_requirement_is_told(text):
    with pytest.raises(ComposerError, match='is no requirement'):
        pin([text], HERE)


def test_a_project_requires_what_its_files_list(tmp_path):
    (tmp_path / 'requirements.txt').write_text(
        '# tools\nnumpy>=1  # arrays\n\n-r more.txt\nclick\n'
    )
    (tmp_path / 'pyproject.toml').write_text(
        '[project]\nname="x"\ndependencies=["click", "lark"]\n'
    )
    assert project_requirements([tmp_path]) == ['numpy>=1', 'click', 'lark']
