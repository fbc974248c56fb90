"""Explain why settings are refused: sentences and codes for the errors of pydantic."""

import difflib
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError

from ..errors import ConfigError, invalid_code

REMOVED = {
    "merge.curvature_persistence": "an end is expected to go straight on, as with 0",
    "sequence.chains": "merge.chains is the number of objects in a sequence, too",
}
"""Removed setting -> the reason in the error that refuses it."""


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
    """Return the error for settings that pydantic refused; name : name of the settings, such as "config mine.yaml"."""
    refusals = [refusal_of(item, model) for item in error.errors()]
    return ConfigError(f"{name}: " + "; ".join(refusal.sentence for refusal in refusals), code=refusals[0].code)


def keys_of(model: type[BaseModel], prefix: str = "") -> list[str]:
    """Return every dotted key of a model, in order: "merge" for a section, "merge.chains" for a setting.

    model : the pydantic model whose fields to list. prefix : text put before each key, such as "merge.".
    """
    keys: list[str] = []
    for name, item in model.model_fields.items():
        kind = item.annotation
        keys.append(prefix + name)
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            keys += keys_of(kind, f"{prefix}{name}.")
    return keys


def refusal_of(item: Any, model: type[BaseModel]) -> Refusal:
    """Return the reason for one error of pydantic."""
    key = ".".join(str(part) for part in item["loc"])
    if item["type"] == "extra_forbidden":
        return _unknown_key(key, model)
    message = item["msg"].removeprefix("Value error, ")
    given = f", got {item['input']!r}" if item["type"] != "value_error" else ""
    return Refusal(f"{key}: {message}{given}" if key else message, invalid_code([item["type"]]))


def _unknown_key(key: str, model: type[BaseModel]) -> Refusal:
    if key in REMOVED:
        return Refusal(f"{key} is no setting any more: {REMOVED[key]}", "key-unknown")
    keys = keys_of(model)
    nearest = difflib.get_close_matches(key, keys, n=1, cutoff=0.5) or [
        known for known in keys if known.split(".")[-1] == key.split(".")[-1]
    ]
    hint = f", did you mean {nearest[0]}?" if nearest else f"; the sections are {', '.join(model.model_fields)}"
    return Refusal(f"unknown key {key}{hint}", "key-unknown")
