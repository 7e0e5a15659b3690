"""A valid or invalid system → another one that may be anything, on three levels."""

import json
import random
import re

import yaml

from tests.fuzz.oddities import BLOCKS, EXPRESSIONS, SCALARS

_TOKEN = re.compile(r'[^\s{}\[\],:]+')
_MOST_ALIASES = 12
_ENDS = ('\r\n', '\r', '\n\r', '\x85', '\u2028', '\n\n', '\n\t', '\n ')
_ENCODINGS = ('utf-16', 'utf-16-le', 'utf-32', 'latin-1', 'utf-8-sig', 'cp1252', 'utf-7')


def mutate(texts, seed, index):
    """Return the content of mutated input number `index`, always the same for one seed."""
    chance = random.Random(f'{seed}:{index}')
    text = chance.choice(texts)
    for _ in range(chance.choice((1, 1, 2, 3, 6))):
        text = chance.choice(_MUTATIONS)(chance, text)
    return _encode(chance, text[:400_000])


def _encode(chance, text):
    if chance.random() < 0.95:
        return text.encode('utf-8', 'surrogatepass')
    content = text.encode(chance.choice(_ENCODINGS), 'replace')
    if chance.random() < 0.3:
        at = chance.randrange(len(content) + 1)
        content = content[:at] + bytes(chance.choices(range(256), k=3)) + content[at:]
    return content


def _odd(chance):
    if chance.random() < 0.4:
        return json.dumps(f'{{{{ {chance.choice(EXPRESSIONS)} }}}}', ensure_ascii=False)
    return chance.choice(SCALARS)


def _insert(chance, text):
    at = chance.randrange(len(text) + 1)
    return text[:at] + _odd(chance) + text[at:]


def _delete(chance, text):
    at = chance.randrange(len(text) + 1)
    return text[:at] + text[at + chance.choice((1, 1, 2, 10, 100)) :]


def _repeat(chance, text):
    at = chance.randrange(len(text) + 1)
    piece = text[at : at + chance.randint(1, 60)]
    return text[:at] + piece * chance.choice((2, 2, 3, 50)) + text[at:]


def _swap_lines(chance, text):
    lines = text.split('\n')
    one, other = chance.randrange(len(lines)), chance.randrange(len(lines))
    lines[one], lines[other] = lines[other], lines[one]
    return '\n'.join(lines)


def _indent(chance, text):
    lines = text.split('\n')
    at = chance.randrange(len(lines))
    lines[at] = chance.choice((' ', '  ', '\t', '- ', '? ', ': ', '# ')) + lines[at]
    return '\n'.join(lines)


def _change_ends(chance, text):
    return text.replace('\n', chance.choice(_ENDS), chance.choice((1, 3, -1)))


def _replace_token(chance, text):
    tokens = list(_TOKEN.finditer(text))
    if not tokens:
        return text
    token = chance.choice(tokens)
    choice = chance.random()
    if choice < 0.6:
        new = _odd(chance)
    elif choice < 0.8:
        new = chance.choice(tokens).group()
    else:
        new = misspell(chance, token.group())
    return text[: token.start()] + new + text[token.end() :]


def _append_block(chance, text):
    block = chance.choice(BLOCKS).replace('%s', str(chance.randrange(100)))
    return f'{block}{text}' if chance.random() < 0.2 else f'{text}\n{block}'


def _change_tree(chance, text):
    if text.count('*') > _MOST_ALIASES:
        return text  # written out, it would take all memory
    try:
        data = yaml.load(text, Loader=getattr(yaml, 'CSafeLoader', yaml.SafeLoader))
        for _ in range(chance.choice((1, 2, 4))):
            places = list(_places(data))
            if places:
                _change_place(chance, places)
        if chance.random() < 0.5:
            return json.dumps(data, ensure_ascii=False, default=str)[:1_000_000]
        return yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
    except (yaml.YAMLError, ValueError, TypeError, LookupError, AttributeError, RecursionError):
        return text  # it is broken enough


def _places(data):
    """Yield each container with each of its keys; of data that aliases let share parts, some."""
    pending = [data]
    for _ in range(500):
        if not pending:
            return
        each = pending.pop()
        keys = list(each) if isinstance(each, dict) else []
        keys = list(range(len(each))) if isinstance(each, list) else keys
        for key in keys:
            yield each, key
            pending.append(each[key])


def _change_place(chance, places):
    container, key = chance.choice(places)
    choice = chance.randrange(6)
    if choice == 0:
        container[key] = _odd(chance)
    elif choice == 1:
        other, other_key = chance.choice(places)
        container[key] = json.loads(json.dumps(other[other_key], default=str))
    elif choice == 2:
        del container[key]
        places[:] = [(other, other_key) for other, other_key in places if other is not container]
    elif choice == 3:
        container[key] = chance.choice(([], {}, None, True, 0, -1, 2**64, 1.5, [container[key]]))
    elif choice == 4 and isinstance(container, dict):
        container[misspell(chance, str(key))] = container.pop(key)
    elif isinstance(container, dict):
        container[_odd(chance)] = container[key]


def misspell(chance, word):
    """Return a word with one letter more, less, other or elsewhere."""
    if len(word) < 2:
        return word + chance.choice('aeiou_')
    at = chance.randrange(len(word) - 1)
    return chance.choice(
        (
            word[:at] + word[at + 1 :],
            word[:at] + word[at + 1] + word[at] + word[at + 2 :],
            word[:at] + chance.choice('abcdefghijklmnopqrstuvwxyz') + word[at + 1 :],
            word[:at] + chance.choice('abcdefghijklmnopqrstuvwxyz') + word[at:],
        )
    )


# The more often something comes of it that is still YAML, the deeper it gets.
_MUTATIONS = (
    _insert,
    _delete,
    _repeat,
    _swap_lines,
    _indent,
    _change_ends,
    *[_append_block] * 2,
    *[_replace_token] * 6,
    *[_change_tree] * 8,
)
