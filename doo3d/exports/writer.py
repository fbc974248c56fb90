"""Which files an export makes, and that they are there whole or not at all."""

from __future__ import annotations

import dataclasses
import os
import shutil
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..outputs.atomic import PREFIX
from ..outputs.run_reader import Results, open_results
from ..types import Detection
from .base import Export, labels
from .pose import PoseLike, moved, read_pose
from .registry import FORMATS, export_class, export_of

Exportable = Detection | Iterable[Detection] | Results | str | Path
Work = list[tuple[Path, Sequence[Detection]]]  # each file or folder to make, and what goes into it


def export(
    results: Exportable,
    to: str,
    path: str | Path,
    *,
    frames: Sequence[str] | None = None,
    pose: PoseLike | None = None,
    force: bool = False,
    **options: Any,
) -> tuple[Path, ...]:
    """Write chains as another program takes them.

    Parameters
    ----------
    results : a detection, several, the results of a run, or the folder that they are in.
    to : a format of `doo3d export --list`.
    path : the file, if all goes into one; otherwise the folder, in which the files are called as the frames.
    frames : the names of those that are wanted; None: all.
    pose : from the coordinates of the results to those wanted (camera to world): 4x4, x y z qx qy qz qw, or a file of it.
    force : overwrite.
    options : those of the format.

    Returns
    -------
    The files (or for a format that is a folder, the folder) that were written.

    Raises
    ------
    InputError : results or a pose that cannot be used, 2-D results in a format for 3-D, a file that exists or cannot be
    written. ConfigError : no such format or option. MissingDependency : its library is not installed.
    """
    kind, path = export_of(to, options), Path(path)
    found = _chosen(_detections(results), frames)
    if not kind.flat and (flat := next((item for item in found if item.mode == "2d"), None)):
        others = ", ".join(name for name in FORMATS if export_class(name).flat)
        raise InputError(f"frame {flat.frame} is 2-D, in pixels, and {to} needs 3-D; 2-D goes to {others}", code="results-2d")
    if pose is not None:
        matrix = read_pose(pose)
        found = [moved(item, matrix) for item in found]
    work = _work(kind, to, found, path)
    _check_free(work, force)
    try:
        return _write(kind, work)
    except OSError as error:
        raise InputError(f"{path}: cannot be written to ({error.strerror or error})", code="out-unwritable") from None


def default_path(results: Path, to: str) -> Path:
    """Where `doo3d export` writes if it is not told: beside the results, `out.npz` or the folder `out_mjcf`."""
    kind, beside = export_class(to), results.resolve()
    one_file = kind.each == "capture" and kind.suffixes
    return beside.with_name(beside.name + (kind.suffixes[0] if one_file else f"_{to}"))


def _detections(results: Exportable) -> list[Detection]:
    if isinstance(results, Detection):
        return [results]
    if isinstance(results, str | Path):
        results = open_results(results)
    found = list(results.detections() if isinstance(results, Results) else results)
    if wrong := [item for item in found if not isinstance(item, Detection)]:
        raise InputError(
            f"a {type(wrong[0]).__name__} cannot be exported: expected detections, as doo3d.detect returns them", code="data-type"
        )
    return found


def _chosen(found: list[Detection], names: Sequence[str] | None) -> list[Detection]:
    if names is None:
        return found
    known = [item.frame for item in found]
    if missing := [name for name in names if name not in known]:
        shown = ", ".join(known[:5]) + (", ..." if len(known) > 5 else "")
        raise InputError(f"no frame {missing[0]!r} among the results: there are {shown or 'none'}", code="frame-unknown")
    return [item for item in found if item.frame in names]


def _work(kind: Export, to: str, found: list[Detection], path: Path) -> Work:
    suffix = path.suffix.lower()
    if kind.each == "capture":
        if kind.suffixes and suffix not in kind.suffixes:
            raise InputError(f"{path}: {to} makes one file, which ends in {' or '.join(kind.suffixes)}", code="out-suffix")
        return [(path, found)]
    pieces = [piece for item in found for piece in (_by_chain(item) if kind.each == "chain" else [item])]
    if suffix in kind.suffixes:
        if len(pieces) != 1:
            raise InputError(
                f"{path}: this makes {len(pieces)} files, one per {kind.each}: name a folder, or choose one frame",
                code="out-needs-folder",
            )
        return [(path, pieces)]
    if suffix in (end for name in FORMATS for end in export_class(name).suffixes):
        raise InputError(f"{path}: a file of {to} ends in {' or '.join(kind.suffixes)}", code="out-suffix")
    work: Work = [(path / f"{piece.frame}{kind.suffix}", [piece]) for piece in pieces]
    if len({target for target, _ in work}) < len(work):
        raise InputError(f"several frames have the same name and would go into one file in {path}", code="frame-names-clash")
    return work


def _by_chain(item: Detection) -> list[Detection]:
    """A detection for each chain, called <frame>_<number>; that of a frame without chains stays as it is."""
    return [
        dataclasses.replace(item, frame=f"{item.frame}_{label}", chains=(chain,), crossings=())
        for label, chain in zip(labels(item), item.chains, strict=True)
    ] or [item]


def _check_free(work: Work, force: bool) -> None:
    there = [target for target, _ in work if target.exists()]
    if there and not force:
        more = f", and {len(there) - 1} more of what would be written" if len(there) > 1 else ""
        raise InputError(f"{there[0]} exists{more}: --force overwrites", code="out-exists")
    for target in there:
        if target.is_dir() and not (target / "metadata.yaml").is_file():
            raise InputError(f"{target} is a folder of something else and is not overwritten", code="out-foreign")


def _write(kind: Export, work: Work) -> tuple[Path, ...]:
    """All of it under temporary names, then under its own: what fails halfway leaves nothing behind."""
    if not work:
        return ()
    top = next(parent for parent in work[0][0].absolute().parents if parent.is_dir())
    with tempfile.TemporaryDirectory(prefix=PREFIX, dir=top) as folder:
        for target, frames in work:
            kind.write(frames, Path(folder) / target.name)
        for target, _ in work:
            target.parent.mkdir(parents=True, exist_ok=True)
            if target.is_dir():
                shutil.rmtree(target)
            os.replace(Path(folder) / target.name, target)
    return tuple(target for target, _ in work)
