"""The kinds of entity that a node has: one row for each, with the facts that all rooms share.

A new kind is a row here, a record in `language/specs.py`, a parser in `language/parsing`, a file
and a row in `runtime/entities`, and its part of the schema; all else follows from its row.
"""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Mapping

ChannelKind: TypeAlias = Literal['topic', 'service', 'action']

# What `goal.status` is, in the order of the numbers of action_msgs/msg/GoalStatus.
_UNDER_WAY, _ENDED = ('accepted', 'executing', 'canceling'), ('succeeded', 'canceled', 'aborted')
GOAL_STATUSES = ('unknown', *_UNDER_WAY, *_ENDED)
# The payload of the publisher that `publish:` names.
PUBLISHED = 'published'
# The folder of a channel's types in an interface package.
TYPE_FOLDERS: dict[ChannelKind, str] = {'topic': 'msg', 'service': 'srv', 'action': 'action'}


@record
class BehaviourKey:
    """A key that names a behaviour, and how this is called.

    Attributes:
        key: The key, as in `accept`.
        arguments: The names of the positional arguments.
        given: The part of the entity's type that the last argument has, as in `Request`; an empty
            string for the type itself, `None` if the behaviour is given its node alone.
        returned: The part that a returned payload becomes, `PUBLISHED`, or `None` for no payload.
        yielded: The same for each payload that it yields.
        may_yield: Whether it may be a generator.
    """

    key: str
    arguments: tuple[str, ...]
    given: str | None = None
    returned: str | None = None
    yielded: str | None = None
    may_yield: bool = False


@record
class EntityKind:
    """A kind of entity.

    Attributes:
        section: The key of a node under which its entities stand.
        noun: One of them in words.
        channel: What it meets others on, `None` for nothing.
        provides: Whether it is the end that publishes or serves.
        has_qos: Whether it has the key `qos`.
        publishes: Whether it has the key `publish`, for what its behaviour returns.
        has_group: Whether it has the key `group`; the behaviours of others run in no group.
        is_timed: Whether its behaviour is called by itself, as by a timer; what creates it returns
            something with rclpy's `reset` and `cancel`.
        missed: What it can miss if callbacks take too long, as attributes of
            `MissedCounts`, by their names in diagnostics.
        behaviours: The keys that name its behaviours.
        unused: What to say of one that no behaviour uses; `None` if behaviours do not use them.
        unmatched: The rule, and what to say of the channel, if there is no other end; `None` if
            none is needed.
        stand_in: The values with which the rest of an invalid entry is read if these keys are
            missing.
    """

    section: str
    noun: str
    channel: ChannelKind | None = None
    provides: bool = False
    has_qos: bool = False
    publishes: bool = False
    has_group: bool = False
    is_timed: bool = False
    missed: Mapping[str, str] = field(default_factory=dict)
    behaviours: tuple[BehaviourKey, ...] = ()
    unused: str | None = None
    unmatched: tuple[str, str] | None = None
    stand_in: Mapping[str, Any] = field(default_factory=dict)

    @property
    def slug(self) -> str:
        """The noun as names of rules have it, as in `service-client`."""
        return self.noun.replace(' ', '-')

    @property
    def sends(self) -> bool:
        """Whether it sends: publishers send messages, and clients requests and goals."""
        return self.provides == (self.channel == 'topic')


_BEHAVIOUR = 'unknown:unknown'


def _event(key: str) -> BehaviourKey:
    """Return the key of a behaviour that is called for a QoS event."""
    return BehaviourKey(key, ('node', 'event'))


_NO_SERVER = ('no-server', "nothing in this system serves '{}'")

ENTITY_KINDS: tuple[EntityKind, ...] = (
    EntityKind('parameters', 'parameter', unused='no behaviour of the node reads it'),
    EntityKind(
        'publishers',
        'publisher',
        'topic',
        provides=True,
        has_qos=True,
        behaviours=(
            _event('on_deadline_missed'),
            _event('on_liveliness_lost'),
            _event('on_incompatible_qos'),
            _event('on_matched'),
        ),
        unused='nothing publishes on it',
        unmatched=('no-subscription', "nothing in this system subscribes to '{}'"),
        stand_in={'type': 'unknown/msg/Unknown'},
    ),
    EntityKind(
        'subscriptions',
        'subscription',
        'topic',
        has_qos=True,
        publishes=True,
        has_group=True,
        missed={'queue overruns': 'overruns'},
        behaviours=(
            BehaviourKey('behaviour', ('node', 'message'), given='', returned=PUBLISHED),
            _event('on_deadline_missed'),
            _event('on_liveliness_changed'),
            _event('on_incompatible_qos'),
            _event('on_message_lost'),
            _event('on_matched'),
        ),
        unmatched=('no-publisher', "nothing in this system publishes '{}'"),
        stand_in={'type': 'unknown/msg/Unknown', 'behaviour': _BEHAVIOUR},
    ),
    EntityKind(
        'timers',
        'timer',
        publishes=True,
        has_group=True,
        is_timed=True,
        missed={'late ticks': 'late_ticks', 'skipped ticks': 'skipped_ticks'},
        behaviours=(
            BehaviourKey(
                'behaviour', ('node',), returned=PUBLISHED, yielded=PUBLISHED, may_yield=True
            ),
        ),
        stand_in={'period': 1.0, 'behaviour': _BEHAVIOUR},
    ),
    EntityKind(
        'sources',
        'source',
        publishes=True,
        is_timed=True,
        behaviours=(
            BehaviourKey(
                'behaviour', ('node',), returned=PUBLISHED, yielded=PUBLISHED, may_yield=True
            ),
            BehaviourKey('cancel', ('node',)),
        ),
        stand_in={'behaviour': _BEHAVIOUR},
    ),
    EntityKind(
        'services',
        'service',
        'service',
        provides=True,
        has_qos=True,
        has_group=True,
        behaviours=(
            BehaviourKey('behaviour', ('node', 'request'), given='Request', returned='Response'),
        ),
        stand_in={'type': 'unknown/srv/Unknown', 'behaviour': _BEHAVIOUR},
    ),
    EntityKind(
        'service_clients',
        'service client',
        'service',
        has_qos=True,
        unused='no behaviour of the node calls it',
        unmatched=_NO_SERVER,
        stand_in={'type': 'unknown/srv/Unknown'},
    ),
    EntityKind(
        'actions',
        'action',
        'action',
        provides=True,
        behaviours=(
            BehaviourKey(
                'behaviour',
                ('node', 'goal'),
                given='Goal',
                returned='Result',
                yielded='Feedback',
                may_yield=True,
            ),
            BehaviourKey('accept', ('node', 'goal'), given='Goal'),
        ),
        stand_in={'type': 'unknown/action/Unknown', 'behaviour': _BEHAVIOUR},
    ),
    EntityKind(
        'action_clients',
        'action client',
        'action',
        behaviours=(
            BehaviourKey('feedback', ('node', 'feedback'), given='Feedback'),
            BehaviourKey('result', ('node', 'result'), given='Result'),
        ),
        unused='no behaviour of the node sends it a goal',
        unmatched=_NO_SERVER,
        stand_in={'type': 'unknown/action/Unknown'},
    ),
)
# Those of the transitions of a node with a lifecycle.
TRANSITION_BEHAVIOURS = (
    *('on_configure', 'on_activate', 'on_deactivate', 'on_cleanup', 'on_error_state'),
)
# The behaviours of a node itself.
NODE_BEHAVIOURS: tuple[BehaviourKey, ...] = (
    BehaviourKey('on_start', ('node',)),
    BehaviourKey('on_stop', ('node',)),
    BehaviourKey('before_parameters_set', ('node', 'changes')),
    BehaviourKey('on_parameters', ('node', 'changes')),
    BehaviourKey('after_parameters_set', ('node', 'changes')),
    *(BehaviourKey(key, ('node',)) for key in TRANSITION_BEHAVIOURS),
)

# What a process calls when it has ended.
EXIT_BEHAVIOUR = BehaviourKey('on_exit', ('process', 'exit_code'))

KIND_OF_SECTION: dict[str, EntityKind] = {kind.section: kind for kind in ENTITY_KINDS}
KIND_OF_NOUN: dict[str, EntityKind] = {kind.noun: kind for kind in ENTITY_KINDS}
# Those that meet others on a topic, service or action.
CHANNEL_KINDS: tuple[EntityKind, ...] = tuple(kind for kind in ENTITY_KINDS if kind.channel)
# Those that behaviours use by name.
USED_KINDS: tuple[EntityKind, ...] = tuple(kind for kind in ENTITY_KINDS if kind.unused)
# The keys that give a node something to do.
WORK_KEYS = frozenset(
    (
        *(kind.section for kind in ENTITY_KINDS if kind.section != 'parameters'),
        *(each.key for each in NODE_BEHAVIOURS),
    )
)
# Every key of an entity that names a behaviour.
BEHAVIOUR_KEYS = frozenset(each.key for kind in ENTITY_KINDS for each in kind.behaviours)
