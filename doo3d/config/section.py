"""Define the base of every section of the settings: frozen models, and fields in two tiers."""

import math
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator
from pydantic.fields import FieldInfo

EXPERT = "expert"
"""Tier of an expert setting, in its `json_schema_extra`; settings without a tier are basic."""


MIN_NUMBER, MAX_NUMBER = 1e-6, 2**31 - 1
"""Smallest and largest absolute value of a setting other than 0.

A micrometre or a millionth is below what any sensor resolves. The largest whole number of 32 bits is more than any image has
pixels; its square and its cube are far from the largest float.
"""

_MAY_BE_INFINITE = {"max_width", "max_width_ratio", "max_cost", "max_gap"}
"""Settings that may be infinite, since presets turn them off by the value .inf."""


def expert(default: Any, description: str, **bounds: Any) -> Any:
    """Return a pydantic field marked as an expert setting, to be assigned in a model's class body.

    Parameters
    ----------
    default
        value of the setting if none is given.
    description
        help text of the setting.
    **bounds
        limits as pydantic's `Field` takes them: ge, gt, le, lt.
    """
    return Field(default, description=description, json_schema_extra={"tier": EXPERT}, **bounds)


def is_expert(field: FieldInfo) -> bool:
    """Return whether a field is an expert setting, made by `expert`."""
    extra = field.json_schema_extra
    return isinstance(extra, dict) and extra.get("tier") == EXPERT


class Section(BaseModel):
    """Base class of the configuration's sections: values cannot be changed, and unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=True)

    @field_validator("*")
    @classmethod
    def _is_usable(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse numbers whose absolute value is above MAX_NUMBER, or below MIN_NUMBER and not 0."""
        given = value.values() if isinstance(value, dict) else value if isinstance(value, tuple) else (value,)
        for number in given:
            if type(number) not in (int, float) or (number == math.inf and info.field_name in _MAY_BE_INFINITE):
                continue
            if number and not MIN_NUMBER <= abs(number) <= MAX_NUMBER:
                raise ValueError(f"is {str(number)[:20]}, expected a number of {MIN_NUMBER:g} to {MAX_NUMBER}")
        return value

    def __repr__(self) -> str:
        """Return the settings that differ from their defaults, by dotted key, such as "Config(merge.chains=1)"."""
        return f"{type(self).__name__}({', '.join(f'{key}={value!r}' for key, value in self._changes())})"

    __str__ = __repr__

    def _changes(self, prefix: str = "") -> Iterator[tuple[str, Any]]:
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            if isinstance(value, Section) and isinstance(field.default, Section):
                yield from value._changes(f"{prefix}{name}.")
            elif value != field.get_default(call_default_factory=True) or field.is_required():
                yield prefix + name, value
