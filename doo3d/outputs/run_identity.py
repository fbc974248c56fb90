"""Identify a run by input, configuration and versions, to recognize its results in a folder."""

import contextlib
import hashlib
import platform
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from .. import __version__
from ..config import Config
from ..errors import InputError
from ..guard.file_names import is_file_name
from ..guard.parsing import parse_yaml, read_json, read_yaml
from . import CONFIG, MANIFEST
from .atomic import PREFIX

SCHEMA = "doo3d/manifest/1"
PACKAGES = ("numpy", "scipy", "opencv-python-headless", "trimesh", "python-fcl", "rustworkx", "open3d", "open3d-cpu")
"""Packages whose versions the manifest records, since results may depend on them."""

_MAX_NAMES = 4  # of changed settings in a note


@dataclass(frozen=True)
class Conflict:
    """The reason why a folder cannot take the results of a run.

    Attributes
    ----------
    reason
        the reason, for the error message.
    code
        machine-readable code of the error, such as "out-other-input".
    can_restart
        whether the option `restart` may replace the results in the folder, because they are of the same input.
    is_setting
        whether they are replaced without `restart`, because only settings differ.
    """

    reason: str
    code: str
    can_restart: bool = False
    is_setting: bool = False


def identity(source: dict[str, Any], config: Config) -> dict[str, Any]:
    """Return the entries of a run's manifest by which results in a folder are recognised as those of the same run.

    Parameters
    ----------
    source
        description of the input: a dict with "path", "format", "frames" (their number) and "files" (a digest).
    config
        the configuration of the run.

    Returns
    -------
    dict
        "schema", "versions" (package -> version), "input" (`source`) and "config_digest" (SHA-256 of the configuration).
    """
    return {"schema": SCHEMA, "versions": _versions(), "input": source, "config_digest": digest(config)}


def digest(config: Config) -> str:
    """Return the SHA-256 of a configuration as 64 hexadecimal digits; equal values give equal digests."""
    return hashlib.sha256(config.to_yaml().encode()).hexdigest()


def _versions() -> dict[str, str]:
    versions = {"doo3d": __version__, "python": platform.python_version()}
    for package in PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            versions[package] = metadata.version(package)
    return versions


def read_manifest(path: Path) -> dict[str, Any] | None:
    """Return the content of `manifest.json` in a folder; None if it is missing, is not JSON, or was not written by doo3d."""
    try:
        manifest = read_json(path / MANIFEST)
    except InputError:
        return None
    is_ours = isinstance(manifest, dict) and str(manifest.get("schema", "")).startswith("doo3d/manifest/")
    return manifest if is_ours else None


def find_conflict(path: Path, former: dict[str, Any] | None, current: dict[str, Any], files_before: str = "") -> Conflict | None:
    """Return the reason why a folder cannot take the results of a run; None if it can.

    None means that the folder does not exist, is empty, or holds results of the same input, configuration and versions.

    Parameters
    ----------
    path
        the folder.
    former
        content of the manifest in the folder; None if there is none.
    current
        the result of `identity` for the new run.
    files_before
        a second accepted digest of the input: the one before files of failed frames changed.
    """
    if not path.is_dir() or not any(not file.name.startswith(PREFIX) for file in path.iterdir()):
        return None
    if former is None:
        return Conflict("the folder is not empty and its content is not a result of doo3d", "out-foreign")
    source, wanted = _mapping(former, "input"), current["input"]
    keys = sorted((source.keys() | wanted.keys()) - {"files", "frames", "choice"}, key=lambda key: (key != "path", key))
    for key in keys:
        if (value := source.get(key)) != wanted.get(key):
            what = value if key == "path" else f"{source.get('path')}, {key} {'not given' if value is None else value}"
            return Conflict(f"the folder holds the results of another input ({what})", "out-other-input")
    if source.get("files") not in (wanted["files"], files_before) or source.get("frames") != wanted["frames"]:
        return Conflict(f"{source.get('path')} has changed since the results in the folder were made", "input-changed", True)
    if former.get("config_digest") != current["config_digest"] or source.get("choice") != wanted.get("choice"):
        return Conflict("the folder holds the results of another configuration", "out-other-config", True, is_setting=True)
    had, has = _mapping(former, "versions"), current["versions"]
    changed = [f"{name} {had.get(name)}, now {has.get(name)}" for name in has if had.get(name) != has[name]]
    if changed:
        return Conflict(f"the folder holds the results of other versions ({'; '.join(changed)})", "versions-changed", True)
    return None


def changed_settings(path: Path, config: Config) -> str:
    """Return the settings that differ between a folder's `config.yaml` and a configuration, such as "merge.chains, seed".

    Empty if the file cannot be read.
    """
    try:
        former = _flat(read_yaml(path / CONFIG))
    except InputError:
        return ""
    now = _flat(parse_yaml(config.to_yaml(), CONFIG))
    names = [name for name in sorted(former.keys() | now.keys()) if former.get(name) != now.get(name)]
    return ", ".join(names[:_MAX_NAMES]) + (f" and {len(names) - _MAX_NAMES} more" if len(names) > _MAX_NAMES else "")


def _flat(values: Any, prefix: str = "") -> dict[str, Any]:
    """Return dotted name -> value of nested settings."""
    if not isinstance(values, dict):
        return {prefix: values}
    nested = [_flat(value, f"{prefix}.{key}" if prefix else str(key)) for key, value in values.items()]
    return {name: value for part in nested for name, value in part.items()}


def frame_names(manifest: dict[str, Any] | None, lines: Iterable[Any]) -> set[str]:
    """Return the names of all frames that a manifest or a journal mentions.

    Parameters
    ----------
    manifest
        content of `manifest.json`; None if there is none.
    lines
        lines of the journal, one dict per frame.

    Returns
    -------
    set of str
        Names that are not plain file names, such as "../a", are left out, because the caller deletes files by these names.
    """
    frames = (manifest or {}).get("frames")
    entries = [*(frames if isinstance(frames, list) else []), *lines]
    names = [entry.get("name") for entry in entries if isinstance(entry, dict)]
    return {name for name in names if isinstance(name, str) and is_file_name(name)}


def _mapping(values: dict[str, Any], key: str) -> dict[str, Any]:
    value = values.get(key)
    return value if isinstance(value, dict) else {}
