"""Check constant messages against the fields of their type."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.interfaces.descriptions import MessageDescription
from composer.interfaces.payload_checks import check_payload

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic


def check_messages(context: CheckContext) -> Iterator[Diagnostic]:
    """Check a timer's `message:` against the type of its publisher."""
    for node in context.spec.nodes.values():
        for timer in node.timers.values():
            path = (*timer.path, 'message')
            publisher = node.publishers.get(timer.publish or '')
            if publisher is None or path not in context.system.positions.values:
                continue
            description = context.catalogue.describe(publisher.type)
            if not isinstance(description, MessageDescription):
                continue
            for finding in check_payload(description, timer.message, context.catalogue):
                at = context.at_key if finding.rule == 'unknown-field' else context.at_value
                yield at((*path, *finding.path), finding.rule, finding.message, help=finding.help)
