"""Hosts for tests are as far from each other as computers are."""

import pytest

from tests.host_bed import Bed, why_there_is_none

_REACH = 'import socket; socket.create_connection(("{}", 22), timeout={})'

pytestmark = pytest.mark.skipif(bool(why_there_is_none()), reason=why_there_is_none())


@pytest.fixture(scope='module')
def bed(tmp_path_factory):
    with Bed(tmp_path_factory.mktemp('bed'), ['front', 'rear']) as bed:
        yield bed


def reaches(host, address, timeout_sec=10):
    return not host.run('python3', '-c', _REACH.format(address, timeout_sec)).returncode


def test_the_laptop_logs_in_to_each_host(bed):
    found = [
        bed.ssh(name, 'hostname; whoami; systemctl --user is-system-running') for name in bed.hosts
    ]
    assert [each.stdout.split() for each in found] == [
        ['front', 'robot', 'running'],
        ['rear', 'robot', 'running'],
    ]


def test_a_host_has_neither_the_project_nor_the_files_of_another(bed):
    front, rear = bed['front'], bed['rear']
    for folder in ('/home/robot', '/tmp', '/dev/shm'):
        assert not front.run('touch', f'{folder}/mine').returncode
        assert rear.run('ls', f'{folder}/mine').returncode
    assert front.run('python3', '-c', 'import composer').returncode
    assert (
        not front.run('sh', '-c', 'ls /root /opt', user='root')
        .stdout.split('/root:')[1]
        .split()[1:]
    )


def test_who_is_cut_off_is_not_reached_until_it_joins(bed):
    front, rear = bed['front'], bed['rear']
    assert reaches(rear, front.address)
    front.cut()
    assert not reaches(rear, front.address, 1)
    front.join()
    assert reaches(rear, front.address, 30)


def test_what_is_lost_does_not_arrive(bed):
    front, rear = bed['front'], bed['rear']
    front.lose(100)
    assert not reaches(rear, front.address, 1)
    front.lose(0)
    assert reaches(rear, front.address)


def test_a_host_that_lost_its_power_has_its_disk_and_an_empty_memory(bed):
    front = bed['front']
    front.run('touch', '/home/robot/kept', '/run/user/1777/lost')
    front.kill()
    assert not reaches(bed['rear'], front.address, 1)
    front.boot()
    assert reaches(bed['rear'], front.address)
    assert not front.run('ls', '/home/robot/kept').returncode
    assert front.run('ls', '/run/user/1777/lost').returncode
