"""Folders of runs: what is in them, and frames that make them fail."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
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


def started(*command: object, env: dict[str, str] | None = None, **options: Any) -> subprocess.Popen[str]:
    """Start a command that finds the scripts of this environment; what it prints is piped."""
    script = Path(sys.executable).parent
    env = (os.environ if env is None else env) | {"PATH": os.pathsep.join([str(script), os.environ["PATH"]])}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.Popen(list(map(str, command)), env=env, **pipes, **options)


def finished_frames(out: Path) -> int:
    """The number of frames in the journal of a run."""
    journal = out / "progress.jsonl"
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


def wait_for(condition: Callable[[], bool], seconds: float = 60) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)
