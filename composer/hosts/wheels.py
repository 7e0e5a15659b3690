"""A wheel of Composer: the same files make the same bytes.

Source: https://packaging.python.org/en/latest/specifications/binary-distribution-format/
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from base64 import urlsafe_b64encode
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import TYPE_CHECKING

from composer import schema
from composer.schema import schema_path

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_PACKAGE = Path(schema.__file__).parent.parent
_DISTRIBUTION, _NAME = 'rclpy-composer', 'rclpy_composer'
_SCHEMAS = ('composer', 'plan', 'report', 'scenario', 'test_report')
_NO_SOURCES = frozenset({'__pycache__', 'node_modules'})
_EPOCH = (1980, 1, 1, 0, 0, 0)
_FILE_MODE = 0o644 << 16


def write_composer_wheel(folder: Path) -> Path:
    """Write a wheel of the Composer that runs, whether it is installed or a source tree."""
    files = {f'composer/{path}': data for path, data in read_folder(_PACKAGE)}
    shipped = _PACKAGE.parent / 'behaviours'
    files |= {f'behaviours/{path}': data for path, data in read_folder(shipped)}
    for schema_name in _SCHEMAS:
        name = f'{schema_name}.schema.json'
        files[f'composer/schemas/{name}'] = schema_path(name).read_bytes()
    try:
        installed = distribution(_DISTRIBUTION)
    except PackageNotFoundError:
        version = '0'
        metadata = f'Metadata-Version: 2.1\nName: {_DISTRIBUTION}\nVersion: {version}\n'
    else:
        version, metadata = installed.version, installed.read_text('METADATA') or ''
    return _write_wheel(folder, version, files, metadata)


def read_folder(folder: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the files below a folder, by their paths in it; not those of tools, nor compiled."""
    for path in sorted(folder.rglob('*')):
        parts = path.relative_to(folder).parts
        is_hidden = any(each.startswith('.') or each in _NO_SOURCES for each in parts)
        if not is_hidden and path.suffix != '.pyc' and path.is_file():
            yield path.relative_to(folder).as_posix(), path.read_bytes()


def _write_wheel(folder: Path, version: str, files: Mapping[str, bytes], metadata: str) -> Path:
    info = f'{_NAME}-{version}.dist-info'
    tags = 'Wheel-Version: 1.0\nGenerator: composer\nRoot-Is-Purelib: true\nTag: py3-none-any\n'
    members = {**files, f'{info}/METADATA': metadata.encode(), f'{info}/WHEEL': tags.encode()}
    lines = [f'{path},{_hash(data)},{len(data)}' for path, data in sorted(members.items())]
    members[f'{info}/RECORD'] = '\n'.join([*lines, f'{info}/RECORD,,', '']).encode()
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, 'w', zipfile.ZIP_DEFLATED) as archive:
        for path, data in sorted(members.items()):
            entry = zipfile.ZipInfo(path, _EPOCH)
            entry.external_attr = _FILE_MODE
            archive.writestr(entry, data, zipfile.ZIP_DEFLATED)
    # A build tag tells sources of one version apart.
    build = hashlib.sha256(members[f'{info}/RECORD']).hexdigest()[:12]
    wheel = folder / f'{_NAME}-{version}-0_{build}-py3-none-any.whl'
    wheel.write_bytes(stream.getvalue())
    return wheel


def _hash(data: bytes) -> str:
    digest = urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip('=')
    return f'sha256={digest}'
