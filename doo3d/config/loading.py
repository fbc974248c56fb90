"""Load presets, YAML files and overrides as a Config."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..errors import ArgumentError, ConfigError
from ..guard.parsing import parse_yaml, read_yaml
from .models import Config
from .refusals import keys_of

ConfigLike = Config | Mapping[str, Any] | str | Path
"""A Config, settings by dotted key, the name of a preset, or the path of a YAML file; `as_config` makes a Config of it."""


def preset_folder() -> Path:
    """Return the folder of the presets' YAML files: in the installed package, or next to the package in a source checkout."""
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
    ConfigError : no such preset or file, broken YAML, an unknown key (the message names the nearest known key), or a value
        out of bounds.
    """
    if not isinstance(name, str | Path) or "\0" in str(name):
        raise _wrong_type(name, "config")
    if not isinstance(overrides, Mapping | None):
        raise _wrong_type(overrides, "overrides")
    values = {str(key): value for key, value in _read(name).items()}
    for key, value in (overrides or {}).items():
        _set_key(values, str(key), value)
    try:
        return Config(**values)
    except ConfigError as error:
        raise ConfigError(str(error).replace("Config", f"config {name}", 1), code=error.code) from None


def as_config(config: ConfigLike | None) -> Config:
    """Convert an argument to a Config.

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
    raise _wrong_type(config, "config")


def _wrong_type(value: object, what: str) -> ArgumentError:
    return ArgumentError(
        f"{what} is a {type(value).__name__}, expected a doo3d.Config, the name of a preset ({', '.join(preset_names())}), "
        'the path of a YAML file, or settings such as {"merge.chains": 1}',
        code="config-type",
    )


def parse_overrides(pairs: Iterable[str]) -> dict[str, Any]:
    """Parse texts such as "merge.chains=2" into dotted keys and values, such as {"merge.chains": 2}, for `load_config`.

    Values are read as YAML, so that "null", "true", numbers and lists have their types. Keys are not checked here. If a key
    occurs twice, the later text counts.

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


def known_keys() -> list[str]:
    """Return every dotted key of the configuration, in order: "merge" for a section, "merge.chains" for a setting."""
    return keys_of(Config)


def _read(name: str | Path) -> dict[str, Any]:
    """Read a preset or a YAML file into nested dictionaries."""
    path = Path(name)
    if path.suffix not in (".yaml", ".yml"):
        path = preset_folder() / f"{name}.yaml"
        names = preset_names()
        if str(name) not in names:
            raise ConfigError(
                f"no preset {str(name)[:99]!r}: the presets are {', '.join(names)}; the name of your own file ends in .yaml",
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
