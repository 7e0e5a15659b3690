"""The functions that expressions may call beside those of jinja2."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from jinja2 import TemplateRuntimeError

from composer.ament import explain_missing_package, find_share, list_packages
from composer.programs import shell_environment

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


class PackageError(TemplateRuntimeError):
    """A package is not installed.

    Attributes:
        help: What to do about it.
    """

    def __init__(self, package: str) -> None:
        super().__init__(f"no package '{package}' is installed")
        self.help = explain_missing_package(package, list_packages())


def read_environment(name: str, default: str | None = None) -> str:
    """Return a variable of the environment, or the default.

    Raises:
        TemplateRuntimeError: There is neither.
    """
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


FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    'env': read_environment,
    'find': find_package_share,
}
