import sys
from . import counters as _counters

for _name, _step in (('up', 1), ('down', -1)):
    setattr(sys.modules[__name__], f'count_{_name}', _counters.make(_step))
