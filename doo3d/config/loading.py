"""How a preset or a YAML file, with overrides, becomes a Config."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ValidationError

from ..errors import ConfigError, invalid_code, unread_code
from .models import Config


def preset_folder() -> Path:
    """Where the presets are: inside the installed package, or beside it in a checkout."""
    package = Path(__file__).parents[1]
    inside = package / "configs"
    return inside if inside.is_dir() else package.parent / "configs"


def preset_names() -> list[str]:
    """The presets that `load_config` finds by name."""
    return sorted(path.stem for path in preset_folder().glob("*.yaml"))


def load_config(name: str | Path = "default", overrides: Mapping[str, Any] | None = None) -> Config:
    """A preset or a YAML file, with overrides.

    Parameters
    ----------
    name : a preset's name, or the path of a YAML file.
    overrides : dotted key -> value, such as {"merge.chains": 2}.

    Raises
    ------
    ConfigError : no such preset or file, broken YAML, an unknown key (with the nearest known one), a value out of bounds.
    """
    values = _read(name)
    for key, value in (overrides or {}).items():
        _put(values, str(key), value)
    try:
        return Config.model_validate(values)
    except ValidationError as error:
        raise ConfigError(
            f"config {name}: " + "; ".join(_sentence(item) for item in error.errors()),
            code=invalid_code(item["type"] for item in error.errors()),
        ) from None


def parse_overrides(pairs: list[str]) -> dict[str, Any]:
    """["merge.chains=2", ...] -> {"merge.chains": 2, ...}; values are read as YAML.

    Raises
    ------
    ConfigError : a pair without "=", or a value that is not YAML.
    """
    result: dict[str, Any] = {}
    for pair in pairs:
        key, equals, text = pair.partition("=")
        if not equals or not key.strip():
            raise ConfigError(f"--set {pair}: expected key=value, such as merge.chains=2", code="override-invalid")
        try:
            result[key.strip()] = yaml.safe_load(text)
        except yaml.YAMLError as error:
            raise ConfigError(f"--set {pair}: the value cannot be read as YAML ({error})", code="yaml-invalid") from None
    return result


def _read(name: str | Path) -> dict[str, Any]:
    path = Path(name)
    if path.suffix not in (".yaml", ".yml"):
        path = preset_folder() / f"{name}.yaml"
        if not path.is_file():
            raise ConfigError(
                f"no preset {str(name)!r}: the presets are {', '.join(preset_names())}; a file of your own ends in .yaml",
                code="preset-unknown",
            )
    try:
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"config {path}: cannot be read ({error.strerror})", code=unread_code(error)) from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ConfigError(f"config {path}: not valid YAML ({error})", code="yaml-invalid") from None
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise ConfigError(
            f"config {path}: expected sections such as 'merge:', got a {type(values).__name__}", code="section-expected"
        )
    return values


def _put(values: dict[str, Any], key: str, value: Any) -> None:
    *sections, last = key.split(".")
    for section in sections:
        inner = values.setdefault(section, {})
        if inner is None:
            inner = values[section] = {}
        if not isinstance(inner, dict):
            raise ConfigError(f"override {key}: {section} is not a section", code="section-expected")
        values = inner
    values[last] = value


def known_keys(model: type[BaseModel] = Config, prefix: str = "") -> list[str]:
    """Every dotted key of the configuration, in order."""
    keys: list[str] = []
    for name, item in model.model_fields.items():
        kind = item.annotation
        keys.append(prefix + name)
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            keys += known_keys(kind, f"{prefix}{name}.")
    return keys


def _sentence(item: Any) -> str:
    key = ".".join(str(part) for part in item["loc"])
    if item["type"] != "extra_forbidden":
        given = f", got {item['input']!r}" if item["type"] != "value_error" else ""
        return f"{key}: {item['msg'].removeprefix('Value error, ')}{given}" if key else item["msg"].removeprefix("Value error, ")
    keys = known_keys()
    near = difflib.get_close_matches(key, keys, n=1, cutoff=0.5) or [
        known for known in keys if known.split(".")[-1] == key.split(".")[-1]
    ]
    hint = f", did you mean {near[0]}?" if near else f"; the sections are {', '.join(Config.model_fields)}"
    return f"unknown key {key}{hint}"
