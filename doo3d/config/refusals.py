"""Why settings are refused: sentences and codes for the errors of pydantic."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError

from ..errors import ConfigError, invalid_code
from .former import FIXED, FORMER, FORMER_VALUES


class Refusal(NamedTuple):
    """One reason why a configuration is refused.

    Attributes
    ----------
    sentence
        the reason, for the user.
    code
        the stable code of the error, such as "key-unknown".
    """

    sentence: str
    code: str


def config_error(error: ValidationError, model: type[BaseModel], name: str) -> ConfigError:
    """Return the error for settings that pydantic refused; name : of the settings, such as "config mine.yaml"."""
    refusals = [refusal for item in error.errors() for refusal in refusals_of(item, model)]
    return ConfigError(f"{name}: " + "; ".join(refusal.sentence for refusal in refusals), code=refusals[0].code)


def keys_of(model: type[BaseModel], prefix: str = "") -> list[str]:
    """Return every dotted key of a model, in order: "merge" for a section, "merge.chains" for a setting.

    model : the pydantic model whose fields to list. prefix : text put before each key, such as
    "merge.".
    """
    keys: list[str] = []
    for name, item in model.model_fields.items():
        kind = item.annotation
        keys.append(prefix + name)
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            keys += keys_of(kind, f"{prefix}{name}.")
    return keys


def refusals_of(item: Any, model: type[BaseModel]) -> list[Refusal]:
    """Return the reasons behind one error of pydantic; several for a former section, one for each of its settings."""
    key, value = ".".join(str(part) for part in item["loc"]), item["input"]
    if item["type"] == "extra_forbidden":
        is_former = key in FORMER and isinstance(value, dict) and value
        return _former_section(key, value, model) if is_former else [_unknown_key(key, model)]
    renamed = FORMER_VALUES.get(key, {}).get(value) if isinstance(value, str) else None
    if renamed is not None:
        return [Refusal(f"{key}: {value} was renamed, use {renamed}", "setting-renamed")]
    message = item["msg"].removeprefix("Value error, ")
    given = f", got {value!r}" if item["type"] != "value_error" else ""
    return [Refusal(f"{key}: {message}{given}" if key else message, invalid_code([item["type"]]))]


def _former_section(section: str, values: Mapping[Any, Any], model: type[BaseModel]) -> list[Refusal]:
    """Return what became of the settings that are given in a section of an earlier version."""
    kept = {f"{section}.{name}": f"{FORMER[section]}.{name}" for name in values}
    known = keys_of(model)
    return [
        _unknown_key(key, model) if key in FORMER or key in FIXED or new not in known else _renamed(key, new)
        for key, new in kept.items()
    ]


def _unknown_key(key: str, model: type[BaseModel]) -> Refusal:
    """Return why a key is refused: it was renamed, it is a constant now, or it never was one."""
    if key in FORMER:
        return _renamed(key, FORMER[key])
    if key in FIXED:
        return Refusal(f"{key} is no longer a setting: doo3d always uses {FIXED[key]}", "setting-fixed")
    if key.partition(".")[0] in FORMER and "." in key:
        section = FORMER[key.partition(".")[0]]
        return Refusal(f"unknown key {key}; its section was renamed, use {section}", "key-unknown")
    keys = keys_of(model)
    nearest = difflib.get_close_matches(key, keys, n=1, cutoff=0.5) or [
        known for known in keys if known.split(".")[-1] == key.split(".")[-1]
    ]
    hint = f", did you mean {nearest[0]}?" if nearest else f"; the sections are {', '.join(model.model_fields)}"
    return Refusal(f"unknown key {key}{hint}", "key-unknown")


def _renamed(key: str, new: str) -> Refusal:
    return Refusal(f"{key} was renamed, use {new}", "setting-renamed")
