"""Systems for what runs services elsewhere: units, Compose files, manifests.

Each form is a module with a `render_files`, which returns the texts of files by their names.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from composer.export.parts import Export

# A run imports the module of its own form only.
FORMS: dict[str, str] = {
    'systemd': 'composer.export.systemd',
    'compose': 'composer.export.compose',
    'kubernetes': 'composer.export.kubernetes',
}


# Documents about the nodes, which run nothing.
NODL = 'nodl'
# A folder with all that hosts are brought: `composer.hosts.bundle`.
ANSIBLE = 'ansible'


def render_files(export: Export) -> dict[str, str]:
    """Return the files of an export by their names.

    Raises:
        UsageError: The form needs an option that is missing.
        ComposerError: The form has no way to say something of it.
    """
    files: dict[str, str] = importlib.import_module(FORMS[export.form]).render_files(export)
    return files
