"""A system → its files, and the line on which each key and value stands."""

import json


def write_yaml(data, chance, twice=()):
    """Return the text and the line of each path; the paths in `twice` are written twice."""
    writer = _Writer(chance, twice)
    writer.mapping(data, (), 0)
    return '\n'.join(writer.text) + '\n', writer.lines


class _Writer:
    def __init__(self, chance, twice):
        self.text, self.lines = [], {}
        self._chance, self._twice = chance, twice

    def mapping(self, data, path, indent):
        for key, value in data.items():
            here = (*path, key)
            if self._chance.random() < 0.1:
                self.text.append(f'{" " * indent}# {key}')
            self._entry(key, value, here, indent)
            if here in self._twice:
                self._entry(key, value, here, indent)

    def _entry(self, key, value, path, indent):
        head = f'{" " * indent}{_scalar(key)}:'
        self.lines[path] = len(self.text) + 1
        block = isinstance(value, dict) and value and len(path) < 5
        if block and (len(path) < 3 or self._chance.random() < 0.6):
            self.text.append(head)
            self.mapping(value, path, indent + 2)
        elif isinstance(value, list) and len(value) > 1 and self._chance.random() < 0.3:
            self.text.append(head)
            for index, item in enumerate(value):
                self._note(item, (*path, index), len(self.text) + 1)
                self.text.append(f'{" " * indent}  - {self._flow(item, (*path, index))}')
        else:
            self._note(value, path, len(self.text) + 1)
            self.text.append(f'{head} {self._flow(value, path)}')

    def _note(self, value, path, line):
        self.lines[path] = line
        inner = enumerate(value) if isinstance(value, list) else ()
        for key, each in value.items() if isinstance(value, dict) else inner:
            self._note(each, (*path, key), line)

    def _flow(self, value, path):
        if isinstance(value, dict):
            entries = [
                f'{_scalar(key)}: {self._flow(each, (*path, key))}'
                for key, each in value.items()
                for _ in range(2 if (*path, key) in self._twice else 1)
            ]
            return f'{{{", ".join(entries)}}}'
        if isinstance(value, list):
            items = enumerate(value)
            return f'[{", ".join(self._flow(each, (*path, i)) for i, each in items)}]'
        return _scalar(value)


def _scalar(value):
    plain = isinstance(value, str) and value.replace('_', 'a').replace('/', 'a').isalnum()
    words = ('true', 'false', 'null')
    return value if plain and value[0].isalpha() and value not in words else json.dumps(value)
