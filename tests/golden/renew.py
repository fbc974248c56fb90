"""What the 2-D mode finds in the sample photographs, kept to be compared with. `python tests/golden/renew.py` writes it anew
(into another folder where one is given).

Look at the diff before committing it: a joint is a line, in pixels.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from doo3d import Chain, detect, load_config
from doo3d.inputs import open_capture

HERE = Path(__file__).parent
PHOTOS = HERE.parents[1] / "sample_clouds" / "photos"
AXES = json.loads((PHOTOS / "axes.json").read_text(encoding="utf-8"))["photos"]
PRESETS = ("image", "paper_2d")
CASES = [(photo, preset) for photo in AXES for preset in PRESETS]
DIGITS = 2  # of a pixel


def found(photo: str, preset: str) -> tuple[Chain, ...]:
    """The chains of a photograph, from its mask; the preset of the paper is told how many there are."""
    shot = open_capture(PHOTOS / f"{photo}.jpg").frames[0].load()
    wanted = {"merge.chains": len(AXES[photo])} if preset == "paper_2d" else {}
    return detect(shot.data, load_config(preset, wanted), shot.mask).chains


def golden(photo: str, preset: str, folder: Path = HERE) -> Path:
    return folder / f"{photo}.{preset}.json"


def text(chains: tuple[Chain, ...]) -> str:
    """JSON with a joint a line: x, y, and 1 where the segment that starts there is occluded."""
    return "[" + ",\n".join(map(_chain, chains)) + "]\n"


def _chain(chain: Chain) -> str:
    hidden = [*chain.occluded.astype(int).tolist(), 0]
    joints = [f"[{x:.{DIGITS}f}, {y:.{DIGITS}f}, {flag}]" for (x, y), flag in zip(chain.joints, hidden, strict=True)]
    head = {"segment_length": chain.segment_length, "radius": round(chain.radius, DIGITS), "closed": chain.closed}
    return json.dumps(head)[:-1] + ', "joints": [\n' + ",\n".join(joints) + "]}"


def difference(old: list[dict[str, Any]], new: list[dict[str, Any]]) -> str:
    """What changed, in words; nothing where nothing did."""
    if [len(chain["joints"]) for chain in old] != [len(chain["joints"]) for chain in new]:
        counts = [" + ".join(str(len(chain["joints"])) for chain in chains) or "no" for chains in (old, new)]
        return f"{counts[1]} joints, were {counts[0]}"
    moved = max((gap(a["joints"], b["joints"]) for a, b in zip(old, new, strict=True)), default=0.0)
    return f"joints moved by up to {moved:.2f} px" if moved else "" if old == new else "radius or flags changed"


def gap(a: list[list[float]], b: list[list[float]]) -> float:
    """The longest way that a joint moved, px."""
    return float(np.linalg.norm(np.array(a)[:, :2] - np.array(b)[:, :2], axis=1).max())


def main(folder: Path = HERE) -> None:
    for photo, preset in CASES:
        path, new = golden(photo, preset, folder), text(found(photo, preset))
        old = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
        print(f"{path.name:<24} {difference(old, json.loads(new)) or 'as it was'}")  # noqa: T201
        path.write_text(new, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
