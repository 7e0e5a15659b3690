"""An entry that lacks something, or has something wrong in it, is still read to its end."""

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

TEXT = """\
version: 1
nodes:
  rover:
    timers:
      a: {period: 1s, behaviour: nowhere:tick, publish: nothing}
      b: {behaviour: nowhere:tick}
      c: {period: 1, behaviour: nowhere.tick, publish: nothing}
      d: {period: 1, publish: nothing}
      e: {rate: fast, publish: good, message: {dat: 3}}
      f: {}
    subscriptions:
      a: {type: std_msgs/String, behaviour: nowhere:hear, publish: nothing, qos: nothing}
      b: {behaviour: nowhere:hear}
      c: {publish: good, topic: a b}
      d: {type: std_msgs/msg/String}
    publishers:
      good: {type: std_msgs/msg/String}
      b: {type: String, qos: nothing}
      c: {topic: x y}
    services:
      a: {type: std_srvs/Empty, behaviour: nowhere:serve}
"""

FOUND = {
    5: ['wrong-type', 'unknown-behaviour', 'unknown-publisher'],
    6: ['missing-key', 'unknown-behaviour'],
    7: ['bad-value', 'unknown-publisher'],
    8: ['missing-key', 'unknown-publisher'],
    9: ['wrong-type', 'unknown-field'],
    10: ['missing-key', 'missing-key'],
    12: [
        'no-publisher',
        'bad-value',
        'unknown-behaviour',
        'unknown-publisher',
        'unknown-qos-profile',
    ],
    13: ['missing-key', 'unknown-behaviour'],
    14: ['missing-key', 'bad-name'],
    15: ['missing-key', 'no-publisher'],
    17: ['no-subscription'],
    18: ['bad-value', 'unknown-qos-profile'],
    19: ['missing-key', 'bad-name'],
    21: ['bad-value', 'unknown-behaviour'],
}


@pytest.mark.ros
def test_a_finding_hides_no_other(tmp_path):
    path = tmp_path / 'rover.yaml'
    path.write_text(TEXT)
    found = {}
    for finding in check_system(load_system(path), InterfaceCatalogue()):
        found.setdefault(finding.span.line, []).append(finding.rule)
    assert found == FOUND
