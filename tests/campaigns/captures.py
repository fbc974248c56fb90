"""The capture that runs are tried on: a few frames of a rope, one of them damaged."""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from builders import captures


def write_capture(folder: Path, frames: int) -> list[str]:
    """Write a capture whose second frame is damaged; the names of its frames."""
    captures.write_capture(folder, frames)
    (folder / "depth" / "000001.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    return [f"{i:06d}" for i in range(frames)]


def result_of(out: Path) -> tuple[dict[str, bytes], list[str]]:
    """Every file of a run but its journals, and the names of the frames in them."""
    files = {file.relative_to(out).as_posix(): file.read_bytes() for file in sorted(out.rglob("*")) if file.is_file()}
    journals = [files.pop(name) for name in list(files) if name.endswith("progress.jsonl")]
    return files, [json.loads(line)["name"] for journal in journals for line in journal.splitlines()]
