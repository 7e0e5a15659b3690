"""Entities that are left out by their `when` are still checked, and not there."""

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system_text

TEXT = """version: 1
args: {debug: false}
nodes:
  camera:
    publishers:
      image: std_msgs/msg/String
      marked: {when: "{{ debug }}", type: std_msgs/msg/String}
    timers:
      shoot: {when: "{{ debug }}", rate: 1, publish: image, message: {dta: x}}
      mark: {rate: 1, publish: marked, message: {data: x}}
  viewer:
    subscriptions:
      marked: {type: std_msgs/msg/String, behaviour: 'behaviours.talker_listener:listen'}
      image: {type: std_msgs/msg/String, behaviour: 'behaviours.talker_listener:listen'}
"""


def test_what_needs_an_entity_that_is_left_out_is_told_and_what_that_uses_is_not_unused():
    found = check_system(load_system_text(TEXT), InterfaceCatalogue())
    # Nothing publishes `image` this time, and `marked` has its publisher the next.
    assert [(each.rule, each.span.line) for each in found] == [
        ('unknown-field', 9),
        ('unknown-publisher', 10),
    ]
