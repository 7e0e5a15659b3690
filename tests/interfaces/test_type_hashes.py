import json

import pytest
from building import SHIPPED

from composer.interfaces.catalogue import InterfaceCatalogue, default_prefixes
from composer.interfaces.definitions.package_folder import load_definitions
from composer.interfaces.prefixes import find_package_prefix
from composer.interfaces.type_hashes import Fields, hash_type, spread_interface

pytestmark = pytest.mark.ros


def installed_structures() -> dict[str, Fields]:
    structures: dict[str, Fields] = {}
    for package in InterfaceCatalogue().packages():
        prefix = find_package_prefix(package, default_prefixes())
        assert prefix is not None
        definitions = load_definitions(package, prefix / 'share' / package)
        for interface in definitions.interfaces.values():
            structures.update(spread_interface(interface))
    return structures


def test_hashes_of_all_installed_types_are_the_published_ones() -> None:
    structures = installed_structures()
    compared = 0
    for prefix in default_prefixes():
        for path in (prefix / 'share').glob('*/*/*.json'):
            hashes = json.loads(path.read_text()).get('type_hashes', ())
            for each in hashes:
                assert each['hash_string'] == hash_type(each['type_name'], structures), each
                compared += 1
    assert compared > 100


def test_the_hash_of_add_two_ints_is_the_official_one() -> None:
    definitions = load_definitions('example_interfaces', SHIPPED / 'example_interfaces')
    structures = installed_structures()
    for interface in definitions.interfaces.values():
        structures.update(spread_interface(interface))
    assert hash_type('example_interfaces/srv/AddTwoInts', structures) == (
        'RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a'
    )
