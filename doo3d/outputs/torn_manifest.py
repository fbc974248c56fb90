"""Restore a manifest that a power failure cut off, from the journal and `config.yaml`."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from . import CONFIG, JOURNAL, MANIFEST
from .atomic import PREFIX
from .detection_json import dumps

TORN_NOTE = f"{MANIFEST} was incomplete, as after a power failure; it is written anew, from the journal"

_BEGIN = dumps({"schema": "doo3d/manifest/"}).split('"\n')[0].encode()
"""First bytes of every manifest of doo3d."""

_UNKNOWN = f"unknown, since {MANIFEST} is damaged"

Identity = Mapping[str, Any]
"""Entries of a manifest that identify a run, from `identity`."""


def is_torn(path: Path) -> bool:
    """Return whether a folder has an incomplete manifest of doo3d: empty, cut off or padded with zero bytes."""
    try:
        content = (path / MANIFEST).read_bytes().rstrip(b"\0")
    except OSError:
        return False
    if not (content.startswith(_BEGIN) or _BEGIN.startswith(content)):
        return False
    try:
        json.loads(content)
    except (ValueError, RecursionError):
        return True
    return False


def run_digests(identity: Identity) -> dict[str, str]:
    """Return short digests that identify a run: "input", "files", "config" and "versions".

    Each line of the journal has them, so that the run is recognized even if the manifest is incomplete.
    """
    parts = {
        "input": {key: value for key, value in identity["input"].items() if key not in ("files", "frames")},
        "files": [identity["input"].get(key) for key in ("files", "frames")],
        "config": identity["config_digest"],
        "versions": identity["versions"],
    }
    return {name: hashlib.sha256(json.dumps(part, sort_keys=True).encode()).hexdigest()[:16] for name, part in parts.items()}


def restored_manifest(
    path: Path, lines: Sequence[Mapping[str, Any]], current: Identity, files_before: str, config: str
) -> dict[str, Any] | None:
    """Return the restored identity of the run with an incomplete manifest; None if the folder is not doo3d's.

    Parameters
    ----------
    path
        the folder.
    lines
        lines of the journal in it.
    current
        the identity of the new run, which will write there.
    files_before
        a second accepted digest of the input's files; see `find_conflict`.
    config
        text of the `config.yaml` of the new run.
    """
    if not lines:
        names = {file.name for file in path.iterdir() if not file.name.startswith(PREFIX)}
        is_ours = names <= {MANIFEST, CONFIG, JOURNAL} or _text(path / CONFIG) == config
        return dict(current) if is_ours else None
    before = {**current, "input": {**current["input"], "files": files_before}}
    was, now, earlier = lines[-1].get("run"), run_digests(current), run_digests(before)
    same = {part for part in now if isinstance(was, dict) and was.get(part) in (now[part], earlier[part])}
    source = dict(current["input"]) if "input" in same else {"path": _UNKNOWN}
    return {
        "schema": current["schema"],
        "versions": current["versions"] if "versions" in same else dict.fromkeys(current["versions"], "unknown"),
        "input": source if "files" in same else source | {"files": _UNKNOWN},
        "config_digest": current["config_digest"] if "config" in same else _UNKNOWN,
    }


def _text(path: Path) -> str | None:
    try:
        return path.read_bytes().decode("utf-8")
    except (OSError, ValueError):
        return None
