"""Count the right frames of coils, and the frames in which the note on a coil is raised, family by family.

    python docs/measure_coils.py
    python docs/measure_coils.py --families coil,tough_coil --seeds 706-711 --cache FOLDER

Each rendered scene is detected with the true mask and the number of cables, with a ragged mask, and with nothing given. A line
has the frames of a family, the right ones by the strict rule, the frames with the note, and the right ones among these.
"""

from __future__ import annotations

import argparse
import os
from collections import defaultdict
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from confidence_frames import rendered

from doo3d import DooError, detect
from doo3d.evaluation.benchmark.cases import scene_cases
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.rendering.ragged_mask import ragged_mask
from doo3d.evaluation.scenes.registry import GROUPS, family_rng
from doo3d.judge.notes import COIL

COILS = ("coil", "tough_coil")
SENSORS = ("d435", "stereo")
GIVEN = ("true mask", "ragged mask", "nothing")


def main() -> None:
    """Print the counts of each sensor, each way to give the object and each family of coils, and of all other families."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--families", default=",".join(GROUPS["all"] + GROUPS["tough"]))
    parser.add_argument("--seeds", default="700-701", help="first and last seed")
    parser.add_argument("--cache", type=Path, help="folder of rendered frames")
    given = parser.parse_args()
    first, last = map(int, given.seeds.split("-"))
    for sensor in SENSORS:
        counts: dict[tuple[str, str], np.ndarray] = defaultdict(lambda: np.zeros(4, int))
        for case in scene_cases(tuple(given.families.split(",")), range(first, last + 1), sensor):
            known, family = rendered(case, given.cache), case.name.rsplit("_", 1)[0]
            for way in GIVEN:
                mask = {"true mask": known.mask, "nothing": None}.get(way, known.mask)
                if way == "ragged mask":
                    mask = ragged_mask(known.mask, family_rng(f"{case.name}/ragged", 0))
                try:
                    found = detect(known.data, {"merge.chains": len(known.truths)} if way == "true mask" else {}, mask)
                except DooError:
                    continue
                right = bool(score(found.chains, known.truths, None, known.data.camera)["correct"])
                noted = any(note.startswith(COIL) for note in found.notes)
                counts[way, family if family in COILS else "other families"] += (1, right, noted, right and noted)
        for (way, family), (frames, right, noted, both) in sorted(counts.items()):
            print(f"{sensor}, {way}, {family}: {frames} frames, {right} right, {noted} noted, of these {both} right")


if __name__ == "__main__":
    main()
