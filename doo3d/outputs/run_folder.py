"""The folder of a run: its frames' files, `config.yaml`, `manifest.json` and the journal `progress.jsonl`."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import platform
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from .. import __version__
from ..config import Config
from ..errors import InputError
from . import SUFFIXES
from .atomic import PREFIX, write_bytes, write_text
from .detection_json import dumps
from .journal import Journal

SCHEMA = "doo3d/manifest/1"
MANIFEST, CONFIG, JOURNAL = "manifest.json", "config.yaml", "progress.jsonl"
_PACKAGES = ("numpy", "scipy", "numba", "opencv-python-headless", "trimesh", "python-fcl", "open3d", "open3d-cpu")


class ResultsFolder:
    """Where a run writes: one process, one frame after the other. A run that was ended at any moment goes on from here.

    A frame is finished when its line is in the journal, which comes after its files. Everything but the journal is the same,
    byte for byte, for the same input and configuration. A run of which nothing comes leaves nothing behind.

    Parameters
    ----------
    path : the folder, made when first needed.
    source : what is run on. Its `files` tell whether the input is as it was; all else, one run's input from another's.
    config : what it is run with.
    names : of the frames.
    restart : start over where the folder holds results of this input; they are removed.
    force : write though the folder holds something else; results of another run in it are removed.

    Attributes
    ----------
    done : name -> line of the journal, of the frames that are finished already: the first so many, in their order.

    Raises
    ------
    InputError : the folder holds something else or cannot be written to, or the names do not fit files.
    """

    def __init__(
        self,
        path: Path,
        source: dict[str, Any],
        config: Config,
        names: Sequence[str],
        *,
        restart: bool = False,
        force: bool = False,
    ) -> None:
        self.path = path
        self._config = config
        self._head = {"schema": SCHEMA, "versions": _versions(), "input": source, "config_digest": digest(config)}
        self._journal = Journal(path / JOURNAL)
        self._made: list[Path] = []
        self._waiting: list[dict[str, Any]] = []
        self._started = False
        _check_names(path, names)
        _check_place(path)
        old = _read_manifest(path)
        if old is None and path.is_dir() and Path(source["path"]) in (path.resolve(), *path.resolve().parents):
            raise InputError(
                f"{path}: belongs to the input, results there could overwrite it: give another folder with -o",
                code="out-in-input",
            )
        other = _difference(path, old, self._head)
        if other and not (force or (restart and other.restart)):
            way = "--restart to start over there" if other.restart else "--force to write there nevertheless"
            raise InputError(f"{path}: {other.what}: give another folder with -o, or {way}", code=other.code)
        lines = self._journal.read() if old is not None else []
        self._replaces = other is not None or (restart and old is not None)
        self._old = _frame_names([*_frames(old), *lines]) if self._replaces else set()
        self.done = {} if self._replaces else self._finished(lines, names)

    def _finished(self, lines: list[dict[str, Any]], names: Sequence[str]) -> dict[str, dict[str, Any]]:
        """The journal's lines of the first frames, up to one that is not in it or whose files are not there."""
        found = {line.get("name"): line for line in lines}
        done: dict[str, dict[str, Any]] = {}
        for name in names:
            line = found.get(name)
            if line is None or (line["status"] == "ok" and not all(self.file(name, each).exists() for each in SUFFIXES.values())):
                break
            done[name] = line
        return done

    def file(self, name: str, suffix: str) -> Path:
        """Where the file of a frame is."""
        return self.path / f"{name}{suffix}"

    def add(self, name: str, line: dict[str, Any], files: dict[str, bytes] | None) -> None:
        """Write a frame's files, then its line in the journal; None for a frame that failed.

        Where other results are to be replaced they stay until the first frame that has not failed.

        Raises
        ------
        InputError : the disk is full or the folder may not be written to.
        """
        if files is None and self._replaces and not self._started:
            self._waiting.append(line)
            return
        try:
            self._start()
            if files is None:
                _remove(self.path, [name])
            for suffix, content in (files or {}).items():
                write_bytes(self.file(name, suffix), content)
            self._journal.add(line)
        except OSError as error:
            self._undo(name)
            raise self._unwritable(error) from None

    def finish(self, values: dict[str, Any]) -> None:
        """Write the manifest of the whole run, with these values in it.

        Raises
        ------
        InputError : the disk is full or the folder may not be written to.
        """
        text = dumps(self._head | {"finished": True} | values)
        try:
            write_text(self.path / CONFIG, self._config.to_yaml())
            write_text(self.path / MANIFEST, text)
        except OSError as error:
            raise self._unwritable(error) from None

    def abandon(self) -> None:
        """Leave nothing of a run of which nothing has come."""
        if not self._started:
            return
        with contextlib.suppress(OSError):
            for name in (JOURNAL, CONFIG, MANIFEST):
                (self.path / name).unlink(missing_ok=True)
            for place in self._made:
                place.rmdir()

    def _unwritable(self, error: OSError) -> InputError:
        kept = "; finished frames are kept, the same command goes on where it was" if self.path.exists() else ""
        return InputError(f"{self.path}: cannot be written to ({error.strerror or error}){kept}", code="out-unwritable")

    def _start(self) -> None:
        if self._started:
            return
        self._made = self._made or [place for place in (self.path, *self.path.parents) if not place.exists()]
        self.path.mkdir(parents=True, exist_ok=True)
        for left in self.path.glob(f"{PREFIX}*.tmp"):
            left.unlink()
        if self._replaces:
            _remove(self.path, self._old)
            self._journal.remove()
        # the manifest first: by it the folder is known as this run's, whatever comes then
        write_text(self.path / MANIFEST, dumps(self._head | {"finished": False, "counts": {}, "figures": {}, "frames": []}))
        write_text(self.path / CONFIG, self._config.to_yaml())
        for line in self._waiting:
            self._journal.add(line)
        self._started = True

    def _undo(self, name: str) -> None:
        """Take back a frame that was not written whole, and a folder that was just made and holds none that is."""
        with contextlib.suppress(OSError):
            _remove(self.path, [name])
            if self._made and not self._journal.read():
                for file in self.path.iterdir():
                    file.unlink()
                for place in self._made:
                    place.rmdir()


@dataclass(frozen=True)
class _Other:
    """What a folder holds that is not this run's; code : of the error. restart : of the same input, and may be made anew."""

    what: str
    code: str
    restart: bool = False


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
            raise InputError(f"two frames are called {name}: their results would be one file", code="frame-names-clash")
        if f"{name}.json" == MANIFEST or not name or Path(name).name != name:
            raise InputError(
                f"a frame is called {name!r}: {path / name}.json cannot be its file, rename the frame", code="frame-name-invalid"
            )
        seen.add(name)


def _check_place(path: Path) -> None:
    standing = next(place for place in (path, *path.absolute().parents) if place.exists())
    if not standing.is_dir():
        raise InputError(f"{path}: {standing} is a file, expected a folder for the results", code="out-is-file")
    if not os.access(standing, os.W_OK | os.X_OK):
        raise InputError(f"{path}: no permission to write in {standing}", code="out-unwritable")


def _read_manifest(path: Path) -> dict[str, Any] | None:
    try:
        found = json.loads((path / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) and str(found.get("schema", "")).startswith("doo3d/manifest/") else None


def _difference(path: Path, old: dict[str, Any] | None, new: dict[str, Any]) -> _Other | None:
    """What the folder holds that is not this run's; None when nothing is."""
    if not path.is_dir() or not any(not file.name.startswith(PREFIX) for file in path.iterdir()):
        return None
    if old is None:
        return _Other("the folder is not empty and what it holds is not a result of doo3d", "out-foreign")
    source, wanted = _mapping(old, "input"), new["input"]
    about = sorted((source.keys() | wanted.keys()) - {"files", "frames"}, key=lambda key: (key != "path", key))
    for key in about:
        if (was := source.get(key)) != wanted.get(key):
            what = was if key == "path" else f"{source.get('path')}, {key} {'not given' if was is None else was}"
            return _Other(f"the folder holds the results of another input ({what})", "out-other-input")
    if old.get("config_digest") != new["config_digest"]:
        return _Other(
            "the folder holds the results of another configuration (see its config.yaml)", "out-other-config", restart=True
        )
    if (source.get("files"), source.get("frames")) != (wanted["files"], wanted["frames"]):
        return _Other(
            f"{source.get('path')} has changed since the results in the folder were made", "input-changed", restart=True
        )
    had, has = _mapping(old, "versions"), new["versions"]
    changed = [f"{name} {had.get(name)}, now {has.get(name)}" for name in has if had.get(name) != has[name]]
    if changed:
        return _Other(f"the folder holds the results of other versions ({'; '.join(changed)})", "versions-changed", restart=True)
    return None


def _mapping(values: dict[str, Any], key: str) -> dict[str, Any]:
    found = values.get(key)
    return found if isinstance(found, dict) else {}


def _frames(manifest: dict[str, Any] | None) -> list[Any]:
    frames = (manifest or {}).get("frames")
    return frames if isinstance(frames, list) else []


def _frame_names(frames: Iterable[Any]) -> set[str]:
    names = [frame.get("name") for frame in frames if isinstance(frame, dict)]
    return {name for name in names if isinstance(name, str) and name and Path(name).name == name}


def _remove(path: Path, names: Iterable[str]) -> None:
    for name in names:
        for suffix in SUFFIXES.values():
            (path / f"{name}{suffix}").unlink(missing_ok=True)
