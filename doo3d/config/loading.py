"""Presets, YAML files and overrides, loaded as a Config."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError

from ..errors import ArgumentError, ConfigError, invalid_code
from ..guard.parsing import parse_yaml, read_yaml
from .former import FIXED, FORMER, FORMER_VALUES
from .models import Config

ConfigLike = Config | Mapping[str, Any] | str | Path
"""A Config, settings by dotted key, the name of a preset, or the path of a YAML file; `as_config` makes a Config of it."""


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


def preset_folder() -> Path:
    """Return the folder of the presets' YAML files: in the installed package, or beside the package in a source checkout."""
    package = Path(__file__).parents[1]
    installed = package / "configs"
    return installed if installed.is_dir() else package.parent / "configs"


def preset_names() -> list[str]:
    """Return the names of the presets, without ".yaml", sorted."""
    return sorted(path.stem for path in preset_folder().glob("*.yaml"))


def load_config(name: str | Path = "default", overrides: Mapping[str, Any] | None = None) -> Config:
    """Load a preset or a YAML file as a Config, and apply overrides.

    Parameters
    ----------
    name
        name of a preset, such as "default" or "image", or path of a YAML file, which ends in .yaml or .yml. Settings that the
        file leaves out have their defaults.
    overrides
        dotted key -> value, such as {"merge.chains": 2}; they take precedence over the file.

    Raises
    ------
    ConfigError : no such preset or file, broken YAML, an unknown key (the message names the nearest known key), a key of an
        earlier version (the message names its new name or the constant that replaced it), or a value out of bounds.
    """
    values = _read(name)
    for key, value in (overrides or {}).items():
        _set_key(values, str(key), value)
    try:
        return Config.model_validate(values)
    except ValidationError as error:
        refusals = [refusal for item in error.errors() for refusal in _refusals(item)]
        raise ConfigError(
            f"config {name}: " + "; ".join(refusal.sentence for refusal in refusals), code=refusals[0].code
        ) from None


def as_config(config: ConfigLike | None) -> Config:
    """Return the settings that an argument stands for.

    config : a Config; the name of a preset or the path of a YAML file; dotted keys -> values, such as {"merge.chains": 1}, over
    the preset "default"; or None for that preset.

    Raises
    ------
    ArgumentError : the argument is of another type.
    ConfigError : as of `load_config`.
    """
    if config is None:
        return Config()
    if isinstance(config, Config):
        return config
    if isinstance(config, str | Path):
        return load_config(config)
    if isinstance(config, Mapping):
        return load_config("default", config)
    raise ArgumentError(
        f"config is a {type(config).__name__}, expected a doo3d.Config, the name of a preset ({', '.join(preset_names())}), "
        'the path of a YAML file, or settings such as {"merge.chains": 1}',
        code="config-type",
    )


def parse_overrides(pairs: Iterable[str]) -> dict[str, Any]:
    """Parse texts such as "merge.chains=2" into dotted keys and values, such as {"merge.chains": 2}, for `load_config`.

    Values are read as YAML, so that "null", "true", numbers and lists have their types. Keys are not checked here. Of two texts
    with one key the later counts.

    Raises
    ------
    ConfigError : a text has no "=" or no key, or its value is not YAML.
    """
    overrides: dict[str, Any] = {}
    for pair in pairs:
        key, equals, text = pair.partition("=")
        if not equals or not key.strip():
            raise ConfigError(f"--set {pair}: expected key=value, such as merge.chains=2", code="override-invalid")
        overrides[key.strip()] = parse_yaml(text, f"--set {' '.join(pair[:80].split())}", ConfigError)
    return overrides


def known_keys(model: type[BaseModel] = Config, prefix: str = "") -> list[str]:
    """Return every dotted key of the configuration, in order: "merge" for a section, "merge.chains" for a setting.

    model : the pydantic model whose fields to list; the whole Config by default. prefix : text put before each key, such as
    "merge.".
    """
    keys: list[str] = []
    for name, item in model.model_fields.items():
        kind = item.annotation
        keys.append(prefix + name)
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            keys += known_keys(kind, f"{prefix}{name}.")
    return keys


def _read(name: str | Path) -> dict[str, Any]:
    """Read a preset or a YAML file into nested dictionaries."""
    path = Path(name)
    if path.suffix not in (".yaml", ".yml"):
        path = preset_folder() / f"{name}.yaml"
        if not path.is_file():
            raise ConfigError(
                f"no preset {str(name)!r}: the presets are {', '.join(preset_names())}; the name of your own file ends in .yaml",
                code="preset-unknown",
            )
    values = read_yaml(path, f"config {path}", ConfigError)
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise ConfigError(
            f"config {path}: expected sections such as 'merge:', got a {type(values).__name__}", code="section-expected"
        )
    return values


def _set_key(values: dict[str, Any], key: str, value: Any) -> None:
    """Set a dotted key in nested dictionaries."""
    *sections, last = key.split(".")
    for section in sections:
        inner = values.setdefault(section, {})
        if inner is None:
            inner = values[section] = {}
        if not isinstance(inner, dict):
            raise ConfigError(f"override {key}: {section} is not a section", code="section-expected")
        values = inner
    values[last] = value


def _refusals(item: Any) -> list[Refusal]:
    """Return the reasons behind one error of pydantic; several for a former section, one for each of its settings."""
    key, value = ".".join(str(part) for part in item["loc"]), item["input"]
    if item["type"] == "extra_forbidden":
        return _former_section(key, value) if key in FORMER and isinstance(value, dict) and value else [_unknown_key(key)]
    renamed = FORMER_VALUES.get(key, {}).get(value) if isinstance(value, str) else None
    if renamed is not None:
        return [Refusal(f"{key}: {value} was renamed, use {renamed}", "setting-renamed")]
    message = item["msg"].removeprefix("Value error, ")
    given = f", got {value!r}" if item["type"] != "value_error" else ""
    return [Refusal(f"{key}: {message}{given}" if key else message, invalid_code([item["type"]]))]


def _former_section(section: str, values: Mapping[Any, Any]) -> list[Refusal]:
    """Return what became of the settings that are given in a section of an earlier version."""
    kept = {f"{section}.{name}": f"{FORMER[section]}.{name}" for name in values}
    known = known_keys()
    return [
        _unknown_key(key) if key in FORMER or key in FIXED or new not in known else _renamed(key, new)
        for key, new in kept.items()
    ]


def _unknown_key(key: str) -> Refusal:
    """Return why a key is refused: it was renamed, it is a constant now, or it never was one."""
    if key in FORMER:
        return _renamed(key, FORMER[key])
    if key in FIXED:
        return Refusal(f"{key} is no longer a setting: doo3d always uses {FIXED[key]}", "setting-fixed")
    if key.partition(".")[0] in FORMER and "." in key:
        section = FORMER[key.partition(".")[0]]
        return Refusal(f"unknown key {key}; its section was renamed, use {section}", "key-unknown")
    keys = known_keys()
    nearest = difflib.get_close_matches(key, keys, n=1, cutoff=0.5) or [
        known for known in keys if known.split(".")[-1] == key.split(".")[-1]
    ]
    hint = f", did you mean {nearest[0]}?" if nearest else f"; the sections are {', '.join(Config.model_fields)}"
    return Refusal(f"unknown key {key}{hint}", "key-unknown")


def _renamed(key: str, new: str) -> Refusal:
    return Refusal(f"{key} was renamed, use {new}", "setting-renamed")
