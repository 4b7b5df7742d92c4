"""Fields of a description that hold quantities with units."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from vdyn_cli.quantities.quantity import Given, Quantity, UnitError, parse


class Strict(BaseModel):
    """A part of a description: frozen, and an unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True, allow_inf_nan=False)


# Units in which a plain number was probably meant, if it is impossible in SI, the most usual first.
_USUAL = {
    "K": ("degC", "degF"),
    "Pa": ("kPa", "hPa", "bar"),
    "kg": ("t", "g"),
    "m": ("mm", "cm"),
    "m^2": ("cm^2", "mm^2"),
}


@dataclass(frozen=True)
class Si:
    """Marks a field as a quantity: ``Annotated[Given, Si("m/s")]`` reads ``70 km/h`` and stores SI.

    ``lower`` and ``upper`` limit the SI value.
    """

    unit: str
    lower: float = float("-inf")
    upper: float = float("inf")

    def _read(self, value: Any) -> Given:
        if isinstance(value, Given):
            return value
        if not isinstance(value, (str, int, float)) or isinstance(value, bool):
            what = "is not a number with a unit"
            raise PydanticCustomError("quantity", what, {"unit": self.unit})
        try:
            given = parse(value, self.unit)
        except UnitError as error:
            raise PydanticCustomError("unit", "{why}", {"why": str(error), "unit": self.unit}) from None
        if not (self.lower <= given.value <= self.upper):
            span = f"{self.lower:g} to {self.upper:g} {self.unit}".strip()
            what = "is outside the physical range ({span}){form}"
            raise PydanticCustomError("range", what, {"span": span, "form": self._meant(value)})
        if self.lower > 0.0 and given.std > given.value:
            unit = f" {self.unit}" if self.unit else ""
            what = (
                "has a standard deviation larger than the value, which is positive: write both in one unit, or the "
                "standard deviation in percent, such as '{example}'"
            )
            raise PydanticCustomError("range", what, {"example": f"{given.value:g}{unit} +- 1 %"})
        return given

    def _meant(self, value: Any) -> str:
        """The remedy for a plain number that lies inside the range in another usual unit; empty if none fits."""
        for unit in _USUAL.get(self.unit, ()) if _plain(value) else ():
            if self.lower <= parse(f"{value} {unit}", self.unit).value <= self.upper:
                return f"; a plain number is in {self.unit}: write '{value} {unit}'"
        return ""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self._read, serialization=core_schema.plain_serializer_function_ser_schema(_written)
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        example = f"1 {self.unit}".strip()
        return {"type": ["number", "string"], "description": f"a quantity, such as '{example}'; plain numbers are SI"}


def _plain(value: Any) -> bool:
    """Whether a value of a description is a finite number without a unit."""
    try:
        return math.isfinite(float(value))
    except (TypeError, ValueError):
        return False


def _written(given: Given) -> Any:
    return given.value if given.std == 0 else [given.value, given.std]


def si(quantity: Quantity) -> Si:
    """The marker for a quantity of the vocabulary, with its unit and physical range."""
    return Si(quantity.unit, quantity.lower, quantity.upper)


def described(quantity: Quantity) -> str:
    """Meaning and unit of a quantity, as the description of its key: ``"vehicle mass as tested, kg"``."""
    return f"{quantity.meaning}, {quantity.unit or 'dimensionless'}"
