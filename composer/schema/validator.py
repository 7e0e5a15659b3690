"""The JSON Schema validator, which says what is not valid, and where."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError
from jsonschema.validators import extend

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.schema.compiler import SchemaCompiler

_check_reference_fully = Draft202012Validator.VALIDATORS['$ref']


def create_validator(schema: dict[str, Any], compiler: SchemaCompiler) -> Any:
    """Return a validator that skips the valid parts of the data.

    Args:
        compiler: The compiler of the same schema.
    """

    def check_reference(
        validator: Any, reference: str, instance: object, part: object
    ) -> Iterable[ValidationError]:
        if compiler.compile_reference(reference)(instance):
            return ()
        return _check_reference_fully(validator, reference, instance, part) or ()

    keywords = {'$ref': check_reference, 'maximum': _check_maximum}
    return extend(Draft202012Validator, keywords)(schema)


def _check_maximum(
    validator: Any, maximum: float, instance: object, _schema: object
) -> Iterator[ValidationError]:
    """As in JSON Schema, but a NaN is beyond every maximum (JSON has none, YAML has)."""
    if validator.is_type(instance, 'number') and not instance <= maximum:  # type: ignore[operator]
        yield ValidationError(f'{instance!r} is greater than the maximum of {maximum!r}')
