"""The folder of a run: its frames' files, `config.yaml` and `manifest.json`."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import platform
from collections.abc import Iterable, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

from .. import __version__
from ..config import Config
from ..errors import InputError
from ..types import Cloud, Detection, Frame, Image
from . import FORMATS, SUFFIXES, writer
from .atomic import PREFIX, write_text
from .document import dumps

SCHEMA = "doo3d/manifest/1"
MANIFEST, CONFIG = "manifest.json", "config.yaml"
_PACKAGES = ("numpy", "scipy", "numba", "opencv-python-headless", "trimesh", "python-fcl", "open3d", "open3d-cpu")


class ResultsFolder:
    """Where a run writes. Nothing is on the disk before the first frame is written.

    Parameters
    ----------
    path : the folder, made when first needed.
    source : what is run on; `path`, `format` and `masks` in it tell one run's input from another's.
    config : what it is run with.
    names : of the frames.
    force : write though the folder holds something else; results of another run in it are removed.

    Raises
    ------
    InputError : the folder holds something else or cannot be written to, or the names do not fit files.
    """

    def __init__(self, path: Path, source: dict[str, Any], config: Config, names: Sequence[str], *, force: bool = False) -> None:
        self.path = path
        self._config = config
        self._head = {"schema": SCHEMA, "versions": _versions(), "input": source, "config_digest": digest(config)}
        self._names = set(names)
        self._made: list[Path] = []
        self._dropped: list[str] = []
        self._started = self._written = False
        _check_names(path, names)
        _check_place(path)
        old = _read_manifest(path)
        if old is None and path.is_dir() and Path(source["path"]) in (path.resolve(), *path.resolve().parents):
            raise InputError(f"{path}: belongs to the input, results there could overwrite it: give another folder with -o")
        other = _difference(path, old, self._head)
        if other and not force:
            raise InputError(f"{path}: {other}: give another folder with -o, or --force to write there nevertheless")
        self._old = _frame_names(old)
        self._is_new = other is not None

    def write(self, name: str, detection: Detection, data: Frame | Cloud | Image) -> None:
        """Write the files of one frame.

        Raises
        ------
        InputError : the disk is full or the folder may not be written to.
        """
        try:
            self._start()
            for kind in FORMATS:
                writer(kind)(self.path / f"{name}{SUFFIXES[kind]}", detection, data)
            self._written = True
        except OSError as error:
            self._undo(name)
            raise InputError(f"{self.path}: cannot be written to ({error.strerror or error})") from None

    def drop(self, name: str) -> None:
        """Remove what an earlier run, or half a `write`, left of a frame; while nothing is written, only note it."""
        if self._started:
            _remove(self.path, [name])
        else:
            self._dropped.append(name)

    def finish(self, counts: dict[str, int], frames: list[dict[str, Any]]) -> None:
        """Write the manifest of the whole run and remove frames of an earlier run that are no longer in the capture.

        Raises
        ------
        InputError : the disk is full or the folder may not be written to.
        """
        try:
            write_text(self.path / MANIFEST, dumps(self._head | {"finished": True, "counts": counts, "frames": frames}))
        except OSError as error:
            raise InputError(f"{self.path}: cannot be written to ({error.strerror or error})") from None
        _remove(self.path, self._old - self._names)

    def _start(self) -> None:
        if self._started:
            return
        self._made = [place for place in (self.path, *self.path.parents) if not place.exists()]
        self.path.mkdir(parents=True, exist_ok=True)
        for left in self.path.glob(f"{PREFIX}*.tmp"):
            left.unlink()
        _remove(self.path, self._old if self._is_new else self._dropped)
        write_text(self.path / CONFIG, self._config.to_yaml())
        write_text(self.path / MANIFEST, dumps(self._head | {"finished": False, "counts": {}, "frames": []}))
        self._started = True

    def _undo(self, name: str) -> None:
        """Take back a frame that was not written whole, and a folder that was just made and holds none that is."""
        with contextlib.suppress(OSError):
            _remove(self.path, [name])
            if self._made and not self._written:
                for file in self.path.iterdir():
                    file.unlink()
                for place in self._made:
                    place.rmdir()


def digest(config: Config) -> str:
    """SHA-256 of the effective configuration: two runs with one digest are configured alike."""
    return hashlib.sha256(config.to_yaml().encode()).hexdigest()


def _versions() -> dict[str, str]:
    versions = {"doo3d": __version__, "python": platform.python_version()}
    for package in _PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            versions[package] = metadata.version(package)
    return versions


def _check_names(path: Path, names: Sequence[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise InputError(f"two frames are called {name}: their results would be one file")
        if f"{name}.json" == MANIFEST or not name or Path(name).name != name:
            raise InputError(f"a frame is called {name!r}: {path / name}.json cannot be its file, rename the frame")
        seen.add(name)


def _check_place(path: Path) -> None:
    standing = next(place for place in (path, *path.absolute().parents) if place.exists())
    if not standing.is_dir():
        raise InputError(f"{path}: {standing} is a file, expected a folder for the results")
    if not os.access(standing, os.W_OK | os.X_OK):
        raise InputError(f"{path}: no permission to write in {standing}")


def _read_manifest(path: Path) -> dict[str, Any] | None:
    try:
        found = json.loads((path / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) and str(found.get("schema", "")).startswith("doo3d/manifest/") else None


def _difference(path: Path, old: dict[str, Any] | None, new: dict[str, Any]) -> str | None:
    """What the folder holds that is not this run's; None when nothing is."""
    if not path.is_dir() or not any(not file.name.startswith(PREFIX) for file in path.iterdir()):
        return None
    if old is None:
        return "the folder is not empty and what it holds is not a result of doo3d"
    source = old.get("input")
    source = source if isinstance(source, dict) else {}
    if any(source.get(key) != new["input"].get(key) for key in ("path", "format", "masks")):
        masks = f", masks {source['masks']}" if "masks" in source else ""
        return f"the folder holds the results of another input ({source.get('path')}{masks})"
    if old.get("config_digest") != new["config_digest"]:
        return "the folder holds the results of another configuration (see its config.yaml)"
    return None


def _frame_names(manifest: dict[str, Any] | None) -> set[str]:
    frames = (manifest or {}).get("frames")
    names = [frame.get("name") for frame in frames if isinstance(frame, dict)] if isinstance(frames, list) else []
    return {name for name in names if isinstance(name, str) and name and Path(name).name == name}


def _remove(path: Path, names: Iterable[str]) -> None:
    for name in names:
        for suffix in SUFFIXES.values():
            with contextlib.suppress(FileNotFoundError):
                (path / f"{name}{suffix}").unlink()
