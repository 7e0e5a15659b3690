"""Whether data are valid, as jsonschema-rs says quickly, and what is not, as jsonschema says."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from jsonschema.exceptions import ValidationError
    from jsonschema_rs import Validator

_ROOT = '#'


class SchemaValidator:
    """The validator of one schema.

    The verdict is that of jsonschema. It accepts all that jsonschema-rs accepts, and some more:
    letters of all scripts in patterns, for one.

    Attributes:
        schema: The schema itself.
    """

    def __init__(self, schema: dict[str, Any]) -> None:
        self.schema = schema
        self._quick: dict[str, Validator] = {}
        try:
            import jsonschema_rs
        except ImportError:  # There are wheels for x86-64 and aarch64.
            self._quick_class = None
        else:
            self._quick_class = jsonschema_rs.Draft202012Validator

    def is_surely_valid(self, data: Any, reference: str = _ROOT) -> bool:
        """Return whether data are known to be valid, without an error to explain.

        Args:
            reference: A definition, as in `#/$defs/node`; the whole schema otherwise.
        """
        if self._quick_class is None:
            return False
        if reference not in self._quick:
            part = {'$ref': reference, '$defs': self.schema['$defs']}
            schema = self.schema if reference == _ROOT else part
            self._quick[reference] = self._quick_class(schema)
        try:
            return self._quick[reference].is_valid(data)
        except ValueError:  # YAML has more than JSON, as keys that are numbers.
            return False

    def iter_errors(self, data: Any) -> Iterator[ValidationError]:
        """Yield what is not valid."""
        errors: Iterator[ValidationError] = self._explaining.iter_errors(data)
        return errors

    @cached_property
    def _explaining(self) -> Any:
        # Importing it takes a fifth of a check's time, and most files are valid.
        from jsonschema import Draft202012Validator
        from jsonschema.exceptions import ValidationError
        from jsonschema.validators import extend

        check_fully = Draft202012Validator.VALIDATORS['$ref']

        def check_reference(
            validator: Any, reference: str, instance: object, part: object
        ) -> Iterable[ValidationError]:
            """Pass over valid parts of the data."""
            if self.is_surely_valid(instance, reference):
                return ()
            return check_fully(validator, reference, instance, part) or ()

        def check_maximum(
            validator: Any, maximum: float, instance: Any, _schema: object
        ) -> Iterator[ValidationError]:
            """As in JSON Schema, but a NaN is beyond every maximum: JSON has none, YAML has."""
            if validator.is_type(instance, 'number') and not instance <= maximum:
                text = f'{instance!r} is greater than the maximum of {maximum!r}'
                yield ValidationError(text)

        keywords = {'$ref': check_reference, 'maximum': check_maximum}
        return extend(Draft202012Validator, keywords)(self.schema)
