"""The other end of a bond; it behaves as `bondcpp` does."""

import uuid
from pathlib import Path
from time import monotonic

import composer
from composer.interfaces.build.provision import import_packages, provide_packages
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.definitions.packages import load_packages

FOLDER = Path(composer.__file__).parent / 'interfaces' / 'packages' / 'bond'
HEARTBEAT_PERIOD_SEC = 0.25


def import_status():
    """Return `bond/msg/Status`, which is built if need be."""
    packages = load_packages({'bond': FOLDER}, InterfaceCatalogue())
    import_packages(provide_packages(packages, print))
    from bond.msg import Status

    return Status


class Bond:
    """One end; `is_formed` and `is_broken` tell how it stands."""

    def __init__(self, node, name, timeout_sec):
        self._status = import_status()
        self._node, self._name, self._timeout_sec = node, name, timeout_sec
        self._instance = str(uuid.uuid4())
        self._heard = None
        self._has_died = False
        self.instances = set()
        self._publisher = node.create_publisher(self._status, 'bond', 5)
        self._subscription = node.create_subscription(self._status, 'bond', self._hear, 100)
        self._timer = node.create_timer(HEARTBEAT_PERIOD_SEC, self._beat)

    @property
    def is_formed(self):
        return self._heard is not None

    @property
    def is_broken(self):
        is_silent = self._heard is not None and monotonic() > self._heard + self._timeout_sec
        return self._has_died or is_silent

    def end(self):
        self._say(is_active=False)
        self._has_died = True
        self._timer.cancel()
        self._node.destroy_timer(self._timer)
        self._node.destroy_subscription(self._subscription)

    def _beat(self):
        if not self._has_died:
            self._say(is_active=True)

    def _hear(self, status):
        if status.id != self._name or status.instance_id == self._instance:
            return
        self.instances.add(status.instance_id)
        if status.active:
            self._heard = monotonic()
        elif not self._has_died:
            self._has_died = True
            self._say(is_active=False)

    def _say(self, *, is_active):
        message = self._status(id=self._name, instance_id=self._instance, active=is_active)
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)
