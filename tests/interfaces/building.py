"""What the tests of interface packages share: definition folders, a cache, and other processes."""

import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SHIPPED = ROOT / 'interfaces'

WriteDefinitions = Callable[[Mapping[str, str]], Path]
RunPython = Callable[..., subprocess.CompletedProcess[str]]
StartProgram = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def write_definitions(tmp_path: Path) -> WriteDefinitions:
    """Write definition files, given by their paths in a new folder, and return that folder."""
    count = 0

    def write(files: Mapping[str, str]) -> Path:
        nonlocal count
        count += 1
        folder = tmp_path / f'definitions_{count}'
        folder.mkdir()
        for name, text in files.items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_text(text, encoding='utf-8')
        return folder

    return write


def process_environment(cache: Path, **changes: str) -> dict[str, str]:
    """Make the environment of a process that finds Composer and uses a cache."""
    return {**os.environ, 'PYTHONPATH': str(ROOT), 'XDG_CACHE_HOME': str(cache), **changes}


@pytest.fixture
def run_python(shared_cache: Path) -> RunPython:
    """Run a program in a process of its own and return what it printed."""

    def run(
        code: str,
        *arguments: object,
        cache: Path = shared_cache,
        **changes: str,
    ) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, '-c', code, *map(str, arguments)],
            env=process_environment(cache, **changes),
            capture_output=True,
            text=True,
            timeout=250,
            check=False,
        )

    return run
