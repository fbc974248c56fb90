"""Plan the files of an export and write them atomically."""

import dataclasses
import os
import shutil
import tempfile
import warnings
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from ..errors import DooWarning, InputError
from ..guard.file_names import check_file_name
from ..inputs.support.pose_file import PoseLike, read_pose
from ..outputs.atomic import PREFIX, writing
from ..outputs.products import Products, checks
from ..outputs.run_reader import Results, open_results, read_detection
from ..types import Detection
from ..types.arguments import each, file_path, flag, text
from .base import Export, labels
from .registry import FORMATS, export_class, export_of

Exportable = Detection | Iterable[Detection] | Results | str | Path
Frames = tuple[str, ...]  # names of the frames in a file
Plan = list[tuple[Path, Sequence[Detection]]]  # each file or folder to write, with its frames

_exported: dict[tuple[Path, Frames], dict[str, list[int] | None]] = {}
"""Checksums of files that this process exported without a run, by path and frames, so that a notebook's cell can be run again."""


def export(
    results: Exportable,
    to: str,
    path: str | Path,
    *,
    frames: Sequence[str] | None = None,
    pose: PoseLike | None = None,
    min_confidence: float = 0.0,
    force: bool = False,
    with_progress: Callable[[Sequence[Any]], Iterable[Any]] = iter,
    **options: Any,
) -> tuple[Path, ...]:
    """Write chains in the format of another program, such as a simulator.

    Parameters
    ----------
    results
        the chains to write: one Detection, several in order, the Results of a run from `open_results`, or the folder of a run.
    to
        name of the format, such as "mjcf"; `doo3d export --list` prints all with their options.
    path
        for formats with one file per capture, the file (for ros2, the folder). For all other formats a folder, in which the files
        are named after the frames; if there is a single file to write, `path` may also be that file.
    frames
        names of the frames to export; None for all.
    pose
        pose of the camera in the world (p_world = pose @ p_camera, m), to export in world coordinates: a 4x4 matrix, the numbers
        x y z qx qy qz qw, or the path of a file with either. None leaves the coordinates as they are: those of the pose that
        `detect` was given, if any.
    min_confidence
        confidence, 0 to 1, below which objects are left out.
    force
        True replaces existing files, which are an error otherwise. Three kinds of unchanged files are always replaced: those made
        from this run, those that this process exported from frames of the same names, and those with the same content.
    with_progress
        called with the list of frames to read, then with the list of files to write; returns an iterable of the same items, for
        example one that shows a progress bar.
    **options
        options of the format, such as radius=0.004.

    Returns
    -------
    tuple of Path
        the files written (for ros2, the folder). If one of the files cannot be made, none is written.

    Raises
    ------
    InputError
        the results or the pose are unusable, 2-D results are given for a 3-D format, or a file exists or cannot be written.
    ConfigError
        unknown format or option.
    MissingDependency
        a library that the format needs is not installed.
    """
    kind, path, force = export_of(text(to, "to"), options), file_path(path, "path"), flag(force, "force")
    found = _select(_detections(results, with_progress), frames)
    detections = [item.confident(min_confidence) for item in found]
    if left_out := sum(len(before.chains) - len(kept.chains) for before, kept in zip(found, detections, strict=True)):
        warnings.warn(f"chains below the confidence {min_confidence:g} are left out: {left_out}", DooWarning, stacklevel=2)
    if not kind.supports_2d and (planar := next((item for item in detections if item.mode == "2d"), None)):
        others = ", ".join(name for name, other in FORMATS.working() if other.supports_2d)
        raise InputError(
            f"frame {planar.frame} is 2-D, in pixels, and {to} needs 3-D: export 2-D results to {others}", code="results-2d"
        )
    if pose is not None:
        matrix = read_pose(pose)
        detections = [item.in_camera().transformed(matrix) for item in detections]
    plan = _plan(kind, to, detections, path)
    made = _products(results)
    existing = [] if force else _not_made_before(plan, made)
    if existing and made is not None:
        raise _exists(existing)
    _check_folders(plan)
    with writing(path):
        written = FORMATS.call(to, _write, kind, plan, with_progress, existing)
    if made is not None:
        made.add(written)
    else:
        _exported.update({(target.resolve(), _names(frames)): checks(target) for target, frames in plan})
    return written


def _products(results: Exportable) -> Products | None:
    """Return the register of files made from a run; None for detections that were not read from a run."""
    folder = results.path if isinstance(results, Results) else results
    return Products(Path(folder)) if isinstance(folder, str | Path) else None


def default_path(results: Path, to: str) -> Path:
    """Return the path that `doo3d export` writes to if none is given.

    The path is next to the folder of the results. For the folder `out`, it is a file such as `out.npz` for a format with one file
    per capture, otherwise a folder such as `out_mjcf`.

    Parameters
    ----------
    results
        folder of the results of a run.
    to
        name of the format, such as "mjcf".

    Raises
    ------
    ConfigError
        there is no format of this name.
    """
    kind, folder = export_class(to), results.resolve()
    one_file = kind.file_per == "capture" and kind.suffixes
    return folder.with_name(folder.name + (kind.suffixes[0] if one_file else f"_{to}"))


def _detections(results: Exportable, with_progress: Callable[[Sequence[Any]], Iterable[Any]]) -> list[Detection]:
    if isinstance(results, Detection):
        return [results]
    if isinstance(results, str | Path):
        results = open_results(results)
    if isinstance(results, Results):
        return [read_detection(results.path / f"{name}.json") for name in with_progress(results.frames)]
    return list(each(results, Detection, "results"))


def _select(detections: list[Detection], names: Sequence[str] | None) -> list[Detection]:
    if names is None:
        return detections
    names = each(names, str, "frames")
    available = [item.frame for item in detections]
    if missing := [name for name in names if name not in available]:
        shown = ", ".join(available[:5]) + (", ..." if len(available) > 5 else "")
        raise InputError(f"no frame {missing[0]!r} in the results: the frames are {shown or 'none'}", code="frame-unknown")
    return [item for item in detections if item.frame in names]


def _plan(kind: Export, to: str, detections: list[Detection], path: Path) -> Plan:
    """Return the files to write and their frames.

    Parameters
    ----------
    kind
        the format.
    to
        name of the format, for messages.
    detections
        all frames.
    path
        file or folder.
    """
    suffix = path.suffix.lower()
    if kind.file_per == "capture":
        if kind.suffixes and suffix not in kind.suffixes:
            raise InputError(f"{path}: {to} writes one file with the suffix {' or '.join(kind.suffixes)}", code="out-suffix")
        return [(path, detections)]
    pieces = [piece for item in detections for piece in (_by_chain(item) if kind.file_per == "chain" else [item])]
    if suffix in kind.suffixes:
        if len(pieces) != 1:
            raise InputError(
                f"{path}: this writes {len(pieces)} files, one per {kind.file_per}: give a folder, or choose one frame",
                code="out-needs-folder",
            )
        return [(path, pieces)]
    if suffix in (end for _, other in FORMATS.working() for end in other.suffixes):
        raise InputError(f"{path}: a file of {to} has the suffix {' or '.join(kind.suffixes)}", code="out-suffix")
    plan: Plan = [(path / f"{check_file_name(piece.frame, to)}{kind.suffix}", [piece]) for piece in pieces]
    if len({target for target, _ in plan}) < len(plan):
        raise InputError(
            f"several frames have the same name and would be written to one file in {path}", code="frame-names-clash"
        )
    return plan


def _by_chain(item: Detection) -> list[Detection]:
    """Return a detection per chain, named <frame>_<number>; a frame without chains stays unchanged."""
    return [
        dataclasses.replace(item, frame=f"{item.frame}_{label}", chains=(chain,), crossings=(), junctions=(), objects=())
        for label, chain in zip(labels(item), item.chains, strict=True)
    ] or [item]


def _names(frames: Sequence[Detection]) -> Frames:
    return tuple(item.frame for item in frames)


def _not_made_before(plan: Plan, made: Products | None) -> list[Path]:
    """Return the existing files of a plan that were changed by a user or made from another run, or other frames without a run."""

    def is_repeated(target: Path, frames: Sequence[Detection]) -> bool:
        if made is not None:
            return made.are_unchanged(target)
        return _exported.get((target.resolve(), _names(frames))) == checks(target)

    return [target for target, frames in plan if target.exists() and not is_repeated(target, frames)]


def _exists(existing: list[Path]) -> InputError:
    more = f", and {len(existing) - 1} more files" if len(existing) > 1 else ""
    return InputError(f"{existing[0]} exists{more}", code="out-exists", remedy="--force replaces them")


def _check_folders(plan: Plan) -> None:
    for target, _ in plan:
        if target.is_dir() and not (target / "metadata.yaml").is_file():
            raise InputError(f"{target} is a folder with other content and is not replaced", code="out-foreign")


def _write(
    kind: Export, plan: Plan, with_progress: Callable[[Sequence[Any]], Iterable[Any]], existing: Sequence[Path]
) -> tuple[Path, ...]:
    """Write all files under temporary names, then rename them, so that a failure leaves no file behind.

    `existing` are files that may not be replaced: a new content that differs from theirs is an error.
    """
    if not plan:
        return ()
    top = next(parent for parent in plan[0][0].absolute().parents if parent.is_dir())
    with tempfile.TemporaryDirectory(prefix=PREFIX, dir=top) as folder:
        for target, frames in with_progress(plan):
            kind.write(frames, Path(folder) / target.name)
        if changed := [target for target in existing if checks(target) != checks(Path(folder) / target.name)]:
            raise _exists(changed)
        for target, _ in plan:
            target.parent.mkdir(parents=True, exist_ok=True)
            if target.is_dir():
                shutil.rmtree(target)
            os.replace(Path(folder) / target.name, target)
    return tuple(target for target, _ in plan)
