"""Which tests run in one process, and which begin first, where pytest runs several processes."""

from xdist.scheduler import LoadScopeScheduling

# To make hosts and deploy to them takes most of the time of these tests: they share them.
_SHARING = 'tests/hosts/'
# What takes minutes begins first, so that nothing else has to wait for it in the end.
LONG = (
    _SHARING,
    'tests/benchmarks/test_subjects.py',
    'tests/runtime/rewiring/test_random_edits.py',
    'tests/runtime/rewiring/test_new_start.py',
    'tests/runtime/external/test_components.py',
    'tests/processes/test_supervisor.py',
    'tests/runtime/lifecycle/test_manager.py',
    'tests/cli/running/test_commands.py',
    'tests/test_service_configs.py',
    'tests/test_shipped_systems.py',
)


class FileScheduling(LoadScopeScheduling):
    """Run the tests of a file in one process: what they share is made once, not in each."""

    def _split_scope(self, nodeid):
        return _SHARING if nodeid.startswith(_SHARING) else nodeid.partition('::')[0]


def turn_of(nodeid):
    """Return what tests are sorted by: those that take long come first, others as they are."""
    return next((turn for turn, each in enumerate(LONG) if nodeid.startswith(each)), len(LONG))
