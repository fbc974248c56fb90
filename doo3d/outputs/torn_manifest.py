"""A manifest that a power failure cut off: the journal and `config.yaml` tell whose results are in the folder."""

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
"""What every manifest of doo3d begins with."""

_UNKNOWN = f"unknown, since {MANIFEST} is damaged"

Identity = Mapping[str, Any]
"""The entries of a manifest by which a run is recognised, from `identity`."""


def is_torn(path: Path) -> bool:
    """Return whether the manifest in a folder is empty, cut off or followed by zero bytes, as far as it is there doo3d's own."""
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
    """Return short digests of what makes a run this one: "input", "files", "config" and "versions".

    Each line of its journal has them, so that a folder whose manifest is torn is still known.
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
    """Return what the torn manifest in a folder said of its run, as far as it can be known; None if the folder is not doo3d's.

    Parameters
    ----------
    path
        the folder.
    lines
        lines of the journal in it.
    current
        the entries of the run that is to write there.
    files_before
        another digest of the input's files that is no difference; see `find_conflict`.
    config
        text of the `config.yaml` of that run.
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
