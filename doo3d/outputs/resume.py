"""Find the finished frames of an interrupted run, so that repeating the command processes only the others."""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from . import STRANDS, SUFFIXES

Line = dict[str, Any]
"""A line of a run's journal: the record of a frame."""


@dataclass(frozen=True)
class Finished:
    """The frames that an earlier run has finished.

    Attributes
    ----------
    leading
        frame name -> line of the journal, for all frames before the first unfinished one.
    later
        the same for the finished frames after it. Their files are complete, but were made before those of an earlier frame of the
        capture, so ids of chains may have to change.
    """

    leading: dict[str, Line] = field(default_factory=dict)
    later: dict[str, Line] = field(default_factory=dict)


def finished_frames(
    folder: Path,
    lines: Sequence[Line],
    names: Sequence[str],
    retry: Callable[[Line], bool] = lambda line: False,
    needed: Sequence[str] = (),
) -> Finished:
    """Return the frames that an interrupted run has finished, from its journal and its files.

    A frame is finished if the journal has a line for it and either all its files are as the line says, by size and CRC-32, or the
    frame failed and need not be tried again.

    Parameters
    ----------
    folder
        folder of the run's results.
    lines
        lines of the run's journal; the last line of each frame counts.
    names
        names of all frames of the run, in order.
    retry
        returns whether a failed frame must be tried again, given its line.
    needed
        suffixes of files without which a frame is not finished.
    """
    by_name = {line["name"]: (position, line) for position, line in enumerate(lines)}
    finished, last, in_order = Finished(), -1, True
    for name in names:
        position, line = by_name.get(name, (-1, None))
        if line is None or not (_is_complete(folder, line, needed) if line["status"] == "ok" else not retry(line)):
            in_order = False
            continue
        in_order = in_order and position > last
        last = position
        (finished.leading if in_order else finished.later)[name] = line
    return finished


def file_checks(files: Mapping[str, bytes]) -> dict[str, list[int]]:
    """Return size in bytes and CRC-32 of a frame's files, for its line in the journal: suffix -> [size, CRC-32]."""
    return {suffix: [len(content), zlib.crc32(content)] for suffix, content in files.items()}


def _is_complete(folder: Path, line: Line, needed: Sequence[str]) -> bool:
    """Return whether the files of a frame have the sizes and CRC-32 in its line; needed : suffixes of files it must have."""
    checks = line.get("files")
    if not isinstance(checks, dict) or not checks.keys() >= set(needed):
        return False
    paths = {suffix: folder / f"{line['name']}{suffix}" for suffix in (*SUFFIXES.values(), STRANDS) if suffix in checks}
    try:
        return file_checks({suffix: path.read_bytes() for suffix, path in paths.items()}) == checks
    except OSError:
        return False
