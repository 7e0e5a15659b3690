"""Files that are no files are not read, and the documentation has the limits of the code."""

import os
import socket
from pathlib import Path

import pytest

import composer
from composer import input_limits
from composer.input_limits import UnreadableFileError, read_file

CHECKING = Path(composer.__file__).parents[1] / 'docs' / 'checking.md'


def reason_for(path, limit=10):
    with pytest.raises(UnreadableFileError) as caught:
        read_file(path, limit)
    return str(caught.value)


def test_a_pipe_a_device_and_a_socket_are_not_read(tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    (tmp_path / 'device').symlink_to('/dev/zero')
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / 'socket'))
        for name, kind in (('pipe', 'named pipe'), ('device', 'device'), ('socket', 'socket')):
            wanted = f'cannot read the file: it is a {kind}, not a regular file'
            assert reason_for(tmp_path / name) == wanted


def test_a_link_to_itself_and_a_folder_are_not_read(tmp_path):
    (tmp_path / 'loop').symlink_to('loop')
    reason = 'cannot read the file: Too many levels of symbolic links'
    assert reason_for(tmp_path / 'loop') == reason
    assert reason_for(tmp_path) == 'cannot read the file: Is a directory'


def test_a_file_is_read_up_to_the_limit(tmp_path):
    path = tmp_path / 'file'
    path.write_bytes(b'x' * 2000)
    assert read_file(path, 2000) == b'x' * 2000
    assert reason_for(path, 1999) == 'the file is larger than 1.999 kB'


def test_a_file_of_the_kernel_is_read_up_to_the_limit_though_it_seems_empty():
    assert reason_for(Path('/proc/self/maps'), 100) == 'the file is larger than 0.1 kB'


def test_the_documentation_lists_the_limits():
    section = CHECKING.read_text().partition('## Limits')[2]
    sizes = {value for name, value in vars(input_limits).items() if name.startswith('MAX_')}
    missing = [
        value
        for value in sizes
        if f'{value:,}' not in section and input_limits.format_size(value) not in section
    ]
    assert not missing
