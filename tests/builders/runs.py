"""Folders of runs: what is in them, and frames that make them fail."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def read_manifest(out: Path) -> dict[str, Any]:
    """The manifest of a run."""
    return json.loads((out / "manifest.json").read_text(encoding="utf-8"))


def files_of(out: Path) -> dict[str, bytes]:
    """Every file of a run but the journal, which holds times."""
    return {file.name: file.read_bytes() for file in out.iterdir() if file.name != "progress.jsonl"}


def break_frame(capture: Path, name: str) -> None:
    """Cut off the depth image of a frame."""
    (capture / "depth" / f"{name}.png").write_bytes(b"\x89PNG\r\n\x1a\n")
