"""The functions that expressions may call beside those of jinja2."""

from __future__ import annotations

import posixpath
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import yaml
from jinja2 import TemplateRuntimeError

from composer.ament import explain_missing_package, find_share, list_packages
from composer.programs import shell_environment

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

_readers: list[set[str]] = []


class PackageError(TemplateRuntimeError):
    """A package is not installed.

    Attributes:
        help: What to do about it.
    """

    def __init__(self, package: str) -> None:
        super().__init__(f"no package '{package}' is installed")
        self.help = explain_missing_package(package, list_packages())


@contextmanager
def variables_noted() -> Iterator[set[str]]:
    """Note which variables of the environment expressions read, until the block ends."""
    names: set[str] = set()
    _readers.append(names)
    try:
        yield names
    finally:
        _readers.pop()


def read_environment(name: str, default: str | None = None) -> str:
    """Return a variable of the environment, or the default.

    Raises:
        TemplateRuntimeError: There is neither.
    """
    for names in _readers:
        names.add(name)
    value = shell_environment().get(name, default)
    if value is None:
        advice = f"give a default, as in env('{name}', 'none')"
        message = f"the environment variable '{name}' is not set; {advice}"
        raise TemplateRuntimeError(message)
    return value


def find_package_share(package: str) -> str:
    """Return the share folder of a ROS package.

    Raises:
        PackageError: It is not installed.
    """
    share = find_share(package)
    if share is None:
        raise PackageError(package)
    return str(share)


def to_bool(value: Any) -> bool:
    """Return whether a text is `true` or `1`, as the conditions of launch files do.

    Raises:
        TemplateRuntimeError: It is neither that nor `false` or `0`.
    """
    text = str(value).strip().lower()
    if text not in TRUTH:
        message = f'{value!r} is neither true nor false'
        raise TemplateRuntimeError(message)
    return TRUTH[text]


def from_yaml(text: Any) -> Any:
    """Return the value that a text is in YAML, as launch files read values of parameters.

    Raises:
        TemplateRuntimeError: It is no value that a parameter can have.
    """
    if not isinstance(text, str):
        return text
    if len(text) > _LONGEST_YAML or ('&' in text and '*' in text):
        message = 'the text is too long, or has anchors'
        raise TemplateRuntimeError(message)
    try:
        value = yaml.safe_load(text) if text else ''
    except (yaml.YAMLError, ValueError) as error:
        message = f'{text!r} is not YAML'
        raise TemplateRuntimeError(message) from error
    items = value if isinstance(value, list) else [value]
    if not all(isinstance(item, bool | int | float | str) for item in items):
        message = f'{text!r} is no value of a parameter'
        raise TemplateRuntimeError(message)
    return value


def path_join(parts: Any) -> str:
    """Return parts of a path as one: an absolute part replaces those before it.

    Raises:
        TemplateRuntimeError: They are no texts.
    """
    items = parts if isinstance(parts, list | tuple) else [parts]
    texts = [item for item in items if isinstance(item, str)]
    if not texts or len(texts) < len(items):
        message = f'path_join needs a list of texts, and not {parts!r}'
        raise TemplateRuntimeError(message)
    return posixpath.join(*texts)


TRUTH = {'true': True, '1': True, 'false': False, '0': False}
_LONGEST_YAML = 10_000
# Filters beside those of jinja2, with the names that they have in Ansible.
FILTERS: Mapping[str, Callable[..., Any]] = {
    'bool': to_bool,
    'from_yaml': from_yaml,
    'path_join': path_join,
}
FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    'env': read_environment,
    'find': find_package_share,
}
