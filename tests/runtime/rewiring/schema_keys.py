"""The keys that the schema knows, and the places in a file where they may stand."""

import json
from collections import defaultdict

from tests.running import ROOT

# In a place: any key of a mapping, or any item of a list.
ANY = '*'


def read_schema_keys():
    """Return all places of each key, as tuples, by its name, such as `timer.period`."""
    schema = json.loads((ROOT / 'schemas/composer.schema.json').read_text())
    places = defaultdict(set)

    def walk(part, name, place):
        if '$ref' in part:
            name = part['$ref'].rpartition('/')[2]
            walk(schema['$defs'][name], name, place)
        for branch in (*part.get('anyOf', ()), *part.get('oneOf', ())):
            walk(branch, name, place)
        for key, inner in part.get('properties', {}).items():
            if inner is not False:  # A key that may not be there.
                places[f'{name}.{key}'].add((*place, key))
                walk(inner, key, (*place, key))
        for each in ('items', 'additionalProperties'):
            if isinstance(part.get(each), dict):
                walk(part[each], name, (*place, ANY))

    walk(schema, 'system', ())
    return {name: sorted(found) for name, found in places.items()}
