"""What every section of the settings is made of: frozen models, and fields in two tiers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

EXPERT = "expert"
"""The tier of a setting in its `json_schema_extra`; settings without one are basic."""


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
    """Tell whether a field is an expert setting (one made by `expert`), not a basic one."""
    extra = field.json_schema_extra
    return isinstance(extra, dict) and extra.get("tier") == EXPERT


class Section(BaseModel):
    """Base class of the configuration's sections: values cannot be changed, and unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=True)

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
