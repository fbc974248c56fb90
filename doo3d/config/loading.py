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

FORMER = {
    "segment.max_ratio": "segment.max_width_ratio",
    "segment.edge_tolerance": "segment.outlier_slope",
    "voxelize.core": "voxelize.core_fraction",
    "voxelize.rim": "voxelize.core_margin_px",
    "voxelize.step": "voxelize.split_at_depth_step",
    "merge.own": "merge.custom_costs",
    "merge.keep_bending": "merge.curvature_persistence",
    "merge.direction_length": "merge.tangent_window_radii",
    "merge.open_weight": "merge.exposed_end_cost",
    "merge.rings": "merge.allow_closed_chains",
    "refine.rounds": "refine.iterations",
    "refine.min_width": "refine.min_radius_ratio",
    "grow": "extend_mask",
    "grow.reach": "extend_mask.max_length",
    "visibility": "visibility",
    "visibility.margin": "visibility.margin",
    "visibility.through": "visibility.own_object_counts_as_free",
    "tracks": "tracking",
    "tracks.lengths": "tracking.max_motion_lengths",
}
"""Names of settings in earlier versions, and what each is called now."""

FIXED = {
    "segment.plane_iterations": "200 draws",
    "segment.ridge_filter": "sato",
    "segment.ridge_sigmas": "2, 4 and 6 px",
    "segment.ridge_pixels": "500000 px",
    "segment.window": "2 px",
    "segment.edge_noise": "3 times the depth noise",
    "segment.edge_support": "7 neighbors",
    "segment.holes": "2 px",
    "segment.cloud_window": "2 point spacings",
    "segment.cloud_support": "0.15",
    "segment.smooth": "always on",
    "segment.steady": "0.3 radii",
    "voxelize.size_over_radius": "0.5; set voxelize.size",
    "voxelize.size_over_spacing": "1.6; set voxelize.size",
    "voxelize.close": "1 voxel",
    "voxelize.max_voxels": "2 million",
    "voxelize.min_component": "12 voxels",
    "thin": "always Lee-Kashyap-Chu thinning",
    "traverse.min_loop": "12 radii",
    "traverse.smooth": "1 radius",
    "traverse.min_bridge": "3 radii",
    "traverse.max_trim": "15 radii",
    "traverse.trim": "1 radius",
    "traverse.separation": "2.2 radii",
    "prune.width_over_voxel": "1.5; set prune.width",
    "merge.open_reach": "2 radii",
    "merge.border": "8 radii",
    "merge.patience": "3 times max_cost",
    "merge.remnant": "0.1",
    "fill.radius": "half the gap at most",
    "fill.max_deviation": "20 degrees",
    "refine.spacing": "0.4 radii",
    "refine.pool": "1 radius",
    "refine.smooth": "1.2 radii",
    "refine.depth_weight": "0.06",
    "refine.depth_noise": "0.15 radii",
    "refine.prior": "0.01",
    "refine.reach": "2.2 radii",
    "refine.extend": "6 radii",
    "refine.stub": "8 radii",
    "grow.rounds": "3",
    "grow.hidden": "8 radii",
    "grow.noise": "6 grey levels",
    "grow.max_difference": "2.5 variances",
    "grow.min_contrast": "1.5 variances",
    "grow.adapt": "0.2",
    "visibility.margin_radii": "1.2 radii",
    "tracks.radii": "10 radii",
    "tracks.keep": "30 frames",
    "fusion.voxel": "the spacing of the points",
    "fusion.cell": "4 voxels",
    "fusion.max_sights": "24 views",
}
"""Settings of earlier versions that are constants now, and their values."""


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
    if key in FORMER:
        return f"{key} is called {FORMER[key]} now"
    if key in FIXED:
        return f"{key} is no setting any more: it is {FIXED[key]}"
    keys = known_keys()
    near = difflib.get_close_matches(key, keys, n=1, cutoff=0.5) or [
        known for known in keys if known.split(".")[-1] == key.split(".")[-1]
    ]
    hint = f", did you mean {near[0]}?" if near else f"; the sections are {', '.join(Config.model_fields)}"
    return f"unknown key {key}{hint}"
