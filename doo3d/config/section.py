"""What every section of the settings is made of: frozen models, and fields in two tiers."""

from __future__ import annotations

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
