"""Files of a host: their digests, and writes that are done as a whole or not at all."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

_CHUNK = 1 << 20


def digest_file(path: Path) -> str | None:
    """Return the SHA-256 of a file; `None` if there is none."""
    total = hashlib.sha256()
    try:
        with path.open('rb') as stream:
            while chunk := stream.read(_CHUNK):
                total.update(chunk)
    except (FileNotFoundError, IsADirectoryError, NotADirectoryError):
        return None
    return total.hexdigest()


def write_file(path: Path, data: bytes, mode: int = 0o644) -> None:
    """Write a file as a whole, and have it on the disk when this returns."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f'.{path.name}.part')
    try:
        with part.open('wb') as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        part.chmod(mode)
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        error.filename = str(path)
        raise


def write_link(path: Path, target: str) -> None:
    """Let a link lead somewhere else, at one moment."""
    part = path.with_name(f'.{path.name}.part')
    part.unlink(missing_ok=True)
    part.symlink_to(target)
    part.replace(path)


def read_link(path: Path) -> str | None:
    """Return where a link leads; `None` if there is none."""
    try:
        return os.readlink(path)  # noqa: PTH115 - as text
    except OSError:
        return None


def read_json(path: Path) -> Any:
    """Return what a file holds; `None` if it is absent or broken."""
    try:
        return json.loads(path.read_text(encoding='utf-8'))
    except (OSError, ValueError):
        return None


def write_json(path: Path, data: Any) -> None:
    """Write data to a file; see `write_file`."""
    write_file(path, json.dumps(data, indent=1, sort_keys=True).encode())


def remove_tree(path: Path) -> None:
    """Remove a folder, if it is there."""
    shutil.rmtree(path, ignore_errors=True)


def remove_empty(*folders: Path) -> None:
    """Remove folders that hold nothing, in this order."""
    for folder in folders:
        with suppress(OSError):
            folder.rmdir()
