"""A least number of items, for models of the scenario."""

from collections.abc import Sized
from dataclasses import dataclass
from typing import TypeVar

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema
from pydantic_core.core_schema import no_info_after_validator_function

SizedT = TypeVar("SizedT", bound=Sized)


@dataclass(frozen=True, slots=True)
class AtLeast:
    """A least number of items, checked once all items are right.

    Pydantic's own ``min_length`` counts only the items without fault, and so reports a second
    fault for every first.
    """

    count: int
    what: str

    def __get_pydantic_core_schema__(
        self, source: type[Sized], handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Check after the items."""
        return no_info_after_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(
        self, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Tell editors the number too."""
        schema = handler(core_schema)
        least = "minProperties" if schema.get("type") == "object" else "minItems"
        return schema | {least: self.count}

    def _check(self, items: SizedT) -> SizedT:
        if len(items) < self.count:
            raise ValueError(f"give at least {self.count} {self.what}")
        return items
