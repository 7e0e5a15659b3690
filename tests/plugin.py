"""How a run of pytest gets the plugin of Composer: this one, and those within tests."""

from importlib.metadata import entry_points

_MODULE = 'composer.pytest_plugin'
# An environment that was made before the plugin has no entry point for it.
_IS_INSTALLED = any(each.name == 'composer' for each in entry_points(group='pytest11'))
PLUGINS = () if _IS_INSTALLED else (_MODULE,)
PLUGIN_OPTIONS = () if _IS_INSTALLED else ('-p', _MODULE)
