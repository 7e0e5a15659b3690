"""How a run of pytest within a test gets the plugin of Composer."""

from importlib.metadata import entry_points

# An environment that was made before the plugin has no entry point for it.
_IS_INSTALLED = any(each.name == 'composer' for each in entry_points(group='pytest11'))
PLUGIN_OPTIONS = () if _IS_INSTALLED else ('-p', 'composer.pytest_plugin')
