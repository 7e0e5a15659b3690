"""What a host keeps of a system: releases, and the files that run."""

import fcntl
import hashlib

import pytest

from composer.hosts.agent.host_errors import HostError
from composer.hosts.agent.store import Store


def manifest(files):
    listed = {
        name: {'digest': hashlib.sha256(data).hexdigest(), 'mode': 0o644}
        for name, data in files.items()
    }
    return {'files': listed, 'unpack': {}, 'contents': {}, 'venv': 'v', 'composer': 'c'}


@pytest.fixture
def store(tmp_path):
    return Store(str(tmp_path), 'robot')


def deploy(store, files):
    for data in files.values():
        store.receive(hashlib.sha256(data).hexdigest(), data)
    release = store.stage(manifest(files))
    store.choose(release)
    return release


def live(store):
    found = (path for path in store.live.rglob('*') if path.is_file())
    return {path.relative_to(store.live).as_posix(): path.read_bytes() for path in found}


def test_what_runs_is_what_the_release_has_and_what_others_wrote(store):
    deploy(store, {'a': b'1', 'folder/b': b'2'})
    (store.live / 'folder/mine').write_bytes(b'3')
    first = store.manifest()
    deploy(store, {'a': b'1', 'c': b'4'})
    assert live(store) == {'a': b'1', 'c': b'4', 'folder/mine': b'3'}
    store.choose('releases/1')
    assert live(store) == {'a': b'1', 'folder/b': b'2', 'folder/mine': b'3'}
    assert store.manifest() == first
    store.choose(None)
    assert live(store) == {'folder/mine': b'3'}
    assert store.manifest() is None


def test_what_was_edited_is_found(store):
    deploy(store, {'a': b'1', 'b': b'2', 'c': b'3'})
    assert store.list_edited() == {}
    (store.live / 'a').write_bytes(b'mine')
    (store.live / 'b').unlink()
    assert store.list_edited() == {'a': hashlib.sha256(b'mine').hexdigest()}
    assert store.list_missing() == ['b']


@pytest.mark.parametrize(
    ('owner', 'told'),
    [
        ('me (process 7)', "'robot' is being deployed here by another name of this host"),
        ('you (process 7)', r"'robot' is being deployed by me \(process 7\), since "),
    ],
)
def test_a_deployment_that_meets_itself_is_no_other_one(store, tmp_path, owner, told):
    path = tmp_path / 'locks' / 'robot'
    path.parent.mkdir()
    path.write_text('me (process 7), since 10:00:00')
    with path.open() as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        with pytest.raises(HostError, match=told):
            store.lock(owner)


def test_a_file_that_has_not_come_whole_is_not_staged(store):
    files = {'a': b'1' * 10}
    store.receive(hashlib.sha256(files['a']).hexdigest(), b'1' * 9)
    with pytest.raises(HostError, match='a has not arrived'):
        store.stage(manifest(files))
    store.receive_part(b'1' * 9)
    store.receive(hashlib.sha256(files['a']).hexdigest(), b'1')
    assert store.stage(manifest(files)) == 'releases/1'


def test_only_the_release_before_is_kept(store):
    for number in range(4):
        deploy(store, {'a': b'%d' % number})
        store.prune()
    assert sorted(each.name for each in (store.root / 'releases').iterdir()) == ['3', '4']
    assert not store.incoming.exists()


def test_a_second_deployment_is_told_whose_the_first_one_is(store, tmp_path):
    store.lock('ann@laptop')
    with pytest.raises(HostError, match="'robot' is being deployed by ann@laptop, since "):
        Store(str(tmp_path), 'robot').lock('bob@desk')
    store._lock.close()


def test_what_others_have_put_there_is_kept(store):
    deploy(store, {'a': b'1', 'folder/b': b'2'})
    foreign = ('live/folder/mine', 'map', 'maps/one')
    # A start that goes back copies all of a release.
    copied = ('live/__pycache__/a.pyc', 'live/wheels/a.whl', 'live/manifest.json')
    for name in (*foreign, *copied):
        (store.root / name).parent.mkdir(parents=True, exist_ok=True)
        (store.root / name).write_bytes(name.encode())
    edited = store.folder / 'edited/robot'
    assert store.keep_others() == [edited / name for name in ('folder/mine', 'map', 'maps/one')]
    store.remove()
    kept = {path.read_bytes().decode() for path in edited.rglob('*') if path.is_file()}
    assert kept == {*foreign}
