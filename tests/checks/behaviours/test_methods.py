"""Behaviours that are methods of a class are checked as functions are."""

import pytest

CODE = """\
class Counting:
    def count(self, node):
        self.total += 1
        return 5


class Talker(Counting):
    def __init__(self, node):
        self.node = node
        self.total = 0

    def talk(self, node, loud=False):
        if self.total > 3:
            self.node.publish('{name}', {payload})

    async def hear(self, node, message):
        return message.{field}

    def steps(self, node, message):
        yield 'x'

    @staticmethod
    def stand(node):
        pass


class Odd:
    def __init__(self, first, second):
        pass

    def tick(self, node):
        pass


def plain(node):
    pass
"""


def system(entity):
    return f"""\
  n:
    publishers:
      words: {{type: std_msgs/msg/String, external: true}}
      echo: {{type: std_msgs/msg/String, external: true}}
    timers:
      {entity if entity.startswith('t:') else "t: {rate: 1, behaviour: 'parts:Talker.talk'}"}
      e: {{rate: 1, publish: echo, message: {{data: x}}}}
    subscriptions: {{{entity if entity.startswith('s:') else ''}}}
"""


@pytest.mark.parametrize(
    ('entity', 'names', 'found'),
    [
        ('', {}, []),
        ("t: {rate: 1, behaviour: 'parts:Talker.count', publish: words}", {}, ['field-type']),
        ('', {'name': 'wrods'}, ['unknown-publisher']),
        ('', {'payload': '5'}, ['field-type']),
        ("s: {type: std_msgs/msg/String, external: true, behaviour: 'parts:Talker.hear'}", {}, []),
        (
            "s: {type: std_msgs/msg/String, external: true, behaviour: 'parts:Talker.hear'}",
            {'field': 'date'},
            ['unknown-field'],
        ),
        ("t: {rate: 1, behaviour: 'parts:Talker.talk', with: {luod: true}}", {}, ['bad-argument']),
        ("t: {rate: 1, behaviour: 'parts:Talker.hear'}", {}, ['bad-signature']),
        ("t: {rate: 1, behaviour: 'parts:Talker.tlak'}", {}, ['unknown-behaviour']),
        ("t: {rate: 1, behaviour: 'parts:plain.talk'}", {}, ['unknown-behaviour']),
    ],
)
def test_a_method_is_checked_as_a_function_is(check, entity, names, found):
    code = CODE
    for key, value in ({'name': 'words', 'payload': "'x'", 'field': 'data'} | names).items():
        code = code.replace(f'{{{key}}}', value)
    rules = [rule for _, rule in check(system(entity), code)]
    assert [each for each in rules if each != 'unused-publisher' or each in found] == found
