"""The base of the records that are published as JSON."""

from __future__ import annotations

import math
from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator


class Entry(BaseModel):
    """A part of a result: frozen, and an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @model_validator(mode="before")
    @classmethod
    def _nan_for_null(cls, data: Any) -> Any:
        numbers = {name for name, field in cls.model_fields.items() if field.annotation is float}
        if not isinstance(data, dict):
            return data
        return {k: math.nan if v is None and k in numbers else v for k, v in data.items()}
