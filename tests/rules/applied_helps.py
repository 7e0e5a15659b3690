"""A help that names what to write is applied: written in the place of what is marked."""

import re
from pathlib import Path

# The helps that name one text for the place of the marked one, or an entry of its mapping.
TEXTS = [
    re.compile(r"did you mean '([^']+)'\?.*"),
    re.compile(r"write ('[^':]+'|\{\{.*\}\}|-?[\w.]+)(?:,.*)?"),
]
ENTRY = re.compile(r"write '(\w+: \w+)'(?: if .*)?")
# The rules with a help that is for people to read, or names a text for another place.
FOR_PEOPLE = {
    'after-the-end', 'bad-answer', 'bad-name', 'bad-node-interface', 'bad-parameter-file', 'bad-remap',
    'bad-parameter-reference',
    'bad-separator', 'bad-system-argument', 'bad-variable', 'bad-when',
    'big-crossing-message', 'blocked-group', 'conflicting-domains', 'conflicting-hosts',
    'conflicting-keys', 'conflicting-types', 'duplicate-constant', 'duplicate-field',
    'duplicate-host', 'duplicate-key', 'duplicate-node', 'endless-loop', 'ephemeral-ports',
    'field-text', 'generator-not-allowed', 'ignored-environment', 'ignored-network-key',
    'incompatible-qos', 'indented-definition', 'long-sleep', 'message-loop',
    'misplaced-file', 'misread-list', 'missed-deadline', 'missing-argument',
    'missing-await', 'missing-middleware', 'missing-parameter', 'missing-return',
    'needs-root', 'never-ends', 'no-clock', 'no-definitions', 'no-effect', 'no-event-loop',
    'no-lifecycle', 'no-network-path', 'no-value', 'not-handed-over', 'nothing-expected',
    'nothing-to-run', 'overridden-parameter', 'process-elsewhere',
    'read-only-message', 'relay-loop', 'second-server', 'service-deadlock',
    'shared-across-workers', 'too-many-entries', 'type-mismatch',
    'unevaluated-expression', 'uninstalled-package', 'unknown-executable',
    'unknown-parameter', 'unreachable-parameters', 'unreadable-file', 'unset-parameter',
    'unused-action-client', 'unused-ignore', 'unused-parameter', 'unused-publisher',
    'unused-service-client', 'unused-state', 'value-cycle', 'wrong-annotation',
    'yaml-syntax',
}  # fmt: skip
# The file with the expression is read by ROS, until its entry has `expressions`.
ELSEWHERE = {'unevaluated-expression'}


def read_help(finding):
    """Return what the help wants: the text of the marked place, and an entry after it."""
    patterns = [*TEXTS, ENTRY]
    match = next(filter(None, (each.fullmatch(finding.help or '') for each in patterns)), None)
    if match is None or finding.span is None:
        return None
    return (finding.span.text, match[1]) if match.re is ENTRY else (match[1], None)


def apply(finding, text, entry):
    """Write a text in the place of the marked one, and an entry into the mapping after it."""
    span = finding.span
    path = Path(span.source.name)
    lines = path.read_text().splitlines(keepends=True)
    line, start = lines[span.line - 1], span.column - 1
    rest = line[start + span.length :]
    if entry is not None:
        rest = re.sub(r': ([^{}\s]+)$', r': {type: \1}', rest)
        rest = rest.replace('{', f'{{{entry}, ', 1)
    lines[span.line - 1] = line[:start] + text + rest
    path.write_text(''.join(lines))
