"""Rules of behaviours that wait for each other."""

from __future__ import annotations

from composer.rules.record import Family, Rule

_DEADLOCK = 'https://docs.ros.org/en/jazzy/How-To-Guides/Sync-Vs-Async.html#sync-deadlock'

DEADLOCK = Family(
    'deadlock',
    'behaviours that wait for what cannot come',
    (
        Rule(
            'service-deadlock',
            'A behaviour waits for a service that its own callback group serves, directly or by a '
            'chain of calls; or on_start waits for one that answers only after it.',
            'Callbacks of one group never run at the same time, so neither can go on.',
            _DEADLOCK,
            is_ignorable=True,
        ),
    ),
)
