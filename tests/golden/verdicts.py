"""Record which frames are right, and compare two records: for changes that are meant to change results.

    python tests/golden/verdicts.py record before.json.xz --data DATA --cache FOLDER
    python tests/golden/verdicts.py compare before.json.xz --data DATA --cache FOLDER

`record` skips the frames that the file has: a run that was stopped goes on. `compare` records by the code as it is, into a
second file if one is named (which may be stopped, too), and prints for each kind of frames how many became right and wrong,
in space and in the image, the chance of so uneven a change (sign test), and by how much the nodes of the longest chains moved
(99th percentile).

The kinds: rendered scenes of a stereo camera and a D435 with the true mask and the number of cables, with a ragged mask
and with nothing given, and without a cable; branched objects; sequences; and, where DATA is given, photographs and
captures of others (see docs/confidence_frames.py). The seeds are not used for anything else, so that nobody has looked
at their frames. `--only TEXT` takes the kinds whose names hold it, `--workers N` that many processes.
"""

from __future__ import annotations

import argparse
import json
import lzma
import os
import pickle
import sys
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "docs"))
from confidence_frames import Known, hard_sources, photograph_sources, rendered

from doo3d import DooError, detect, load_config
from doo3d.evaluation.benchmark.ablations import sign_test
from doo3d.evaluation.benchmark.cases import scene_cases
from doo3d.evaluation.benchmark.trees import tree_cases
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.metrics.trees import score_trees
from doo3d.evaluation.rendering.ragged_mask import ragged_mask
from doo3d.evaluation.scenes.registry import GROUPS, TREES, family_rng
from doo3d.evaluation.sequences.evaluate import measure_sequence, sequence_case
from doo3d.evaluation.sequences.motions import OWN_MOTIONS
from doo3d.evaluation.sequences.scenes import make_sequence

SENSORS = ("stereo", "d435")
SEEDS, EMPTY_SEEDS, TREE_SEEDS = range(600, 606), range(600, 612), range(600, 624)
SEQUENCE_SEEDS, SEQUENCE_FRAMES = range(600, 603), 50
NODES = 8
"""Points along the longest chain whose places are compared."""
UNITS = {3: 1e-4, 2: 0.1}
"""What a place is rounded to: m in space, px in an image."""
SAVE_EVERY = 50
"""Frames after which the file is written."""

Verdict = list[Any]
"""Right by the strict rule and in the image, as 0 or 1; number of chains; and the places of the longest one's nodes."""


class Work(NamedTuple):
    """Frames that are rendered or read together: called, `run` returns the verdict of each by its name."""

    kind: str
    names: tuple[str, ...]
    run: Callable[[], list[Verdict]]


def works(data: Path | None, cache: Path | None) -> Iterator[Work]:
    """Yield all frames, kind by kind."""
    for sensor in SENSORS:
        for case in scene_cases(GROUPS["all"] + GROUPS["tough"], SEEDS, sensor):
            for given in ("true mask", "ragged mask", "nothing"):
                yield Work(f"{sensor}, {given}", (case.name,), partial(_scene, case, cache, given))
        for case in scene_cases(GROUPS["without"], EMPTY_SEEDS, sensor):
            yield Work(f"{sensor}, no cable", (case.name,), partial(_scene, case, cache, "nothing"))
    for case in tree_cases(TREES, TREE_SEEDS):
        yield Work("branched, true mask", (case.name,), partial(_tree, case, cache, True))
        if case.seed in TREE_SEEDS[:12]:
            yield Work("branched, nothing", (case.name,), partial(_tree, case, cache, False))
    for sensor in SENSORS:
        for motion in OWN_MOTIONS:
            for seed in SEQUENCE_SEEDS:
                names = tuple(f"{motion}-{seed} {k}" for k in range(SEQUENCE_FRAMES))
                yield Work(f"{sensor}, sequences", names, partial(_sequence, motion, seed, sensor, cache))
    if data is not None:
        hard = hard_sources(data / "hard_scenes") if (data / "hard_scenes").is_dir() else ()
        for source in (*photograph_sources(data), *hard):
            for name, load in source.frames:
                yield Work(f"{source.name} (data of others)", (name,), partial(_known, load))


def _scene(case: Any, cache: Path | None, given: str) -> list[Verdict]:
    known = rendered(case, cache)
    settings, mask = {}, None
    if given == "true mask":
        settings, mask = {"merge.chains": max(1, len(known.truths))}, known.mask
    elif given == "ragged mask":
        mask = ragged_mask(known.mask, family_rng(f"{case.name}/ragged", 0))
    chains, detection = _found(known.data, settings, mask)
    if not known.truths:
        return [_verdict(not chains, not chains, chains)]
    found = score(chains, known.truths, detection and detection.crossings, known.data.camera)
    return [_verdict(found.correct, found.image_correct, chains)]


def _tree(case: Any, cache: Path | None, with_mask: bool) -> list[Verdict]:
    known = rendered(case, cache)
    chains, detection = _found(known.data, {}, known.mask if with_mask else None, "harness")
    right = detection is not None and score_trees(detection, known.scene).correct
    return [_verdict(right, right, chains)]


def _sequence(motion: str, seed: int, sensor: str, cache: Path | None) -> list[Verdict]:
    sequence = make_sequence(motion, seed, frames=SEQUENCE_FRAMES)
    if cache is not None:
        sequence = _Kept(sequence, cache / f"{sensor}_{motion}_{seed}.pkl")
    rows = measure_sequence(sequence_case(sequence, sensor), load_config("default"))
    rows = [row for row in rows if row.variant == "sequence"]
    return [_verdict(row.correct, row.image_correct, row.detection.chains) for row in rows]


class _Kept:
    """A sequence whose rendered frames are kept in a file."""

    def __init__(self, sequence: Any, file: Path) -> None:
        self.sequence, self.file, self.name, self.seed = sequence, file, sequence.name, sequence.seed

    def __len__(self) -> int:
        return len(self.sequence)

    def frames(self, sensor: str) -> list[Any]:
        if not self.file.exists():
            self.file.parent.mkdir(parents=True, exist_ok=True)
            self.file.write_bytes(zlib.compress(pickle.dumps(list(self.sequence.frames(sensor))), 1))
        return pickle.loads(zlib.decompress(self.file.read_bytes()))


def _known(load: Callable[[], Known | None]) -> list[Verdict]:
    known = load()
    assert known is not None
    settings = {"merge.chains": known.cables} if known.is_counted else {}
    preset = "default" if hasattr(known.data, "depth") else "image"
    chains, _ = _found(known.data, settings, known.mask, preset)
    right = sum(known.judge(chains))
    return [_verdict(right == len(chains) == known.cables, right >= known.cables, chains)]


def _found(data: Any, settings: dict[str, Any], mask: Any, preset: str = "default") -> tuple[Any, Any]:
    try:
        detection = detect(data, load_config(preset, settings), mask)
    except DooError:
        return (), None
    return detection.chains, detection


def _verdict(right: bool, in_image: bool, chains: Any) -> Verdict:
    longest = max(chains, key=lambda chain: chain.length, default=None)
    places = [] if longest is None else np.rint(longest.nodes(NODES) / UNITS[longest.joints.shape[1]]).astype(int).tolist()
    return [int(right), int(in_image), len(chains), places]


def record(path: Path, chosen: list[Work], workers: int) -> dict[str, dict[str, Verdict]]:
    """Return the verdicts of a file, kind by kind, with those that it lacks, which are added to it."""
    found: dict[str, dict[str, Verdict]] = json.loads(lzma.open(path).read()) if path.exists() else {}
    left = [work for work in chosen if work.names[0] not in found.get(work.kind, {})]
    with ProcessPoolExecutor(workers) as pool:
        results = pool.map(_run, (work.run for work in left))
        for count, (work, verdicts) in enumerate(zip(left, results, strict=True), 1):
            found.setdefault(work.kind, {}).update(zip(work.names, verdicts, strict=True))
            if count % SAVE_EVERY == 0 or count == len(left):
                lzma.open(path.with_suffix(".part"), "w").write(json.dumps(found).encode())
                path.with_suffix(".part").replace(path)
                print(f"\r{count} of {len(left)}", end="", file=sys.stderr, flush=True)  # noqa: T201
    return found


def _run(run: Callable[[], list[Verdict]]) -> list[Verdict]:
    return run()


def summary(before: dict[str, dict[str, Verdict]], after: dict[str, dict[str, Verdict]]) -> str:
    """Return a table with a line for each kind of frames, and one for all."""
    lines = [
        f"{'':50s} {'frames':>6s}"
        + "".join(f" {title:>11s} {'':>9s} {'chance':>6s}" for title in ("right", "in image"))
        + "   99 % moved"
    ]
    pairs = {
        kind: [(old, after[kind][name]) for name, old in rows.items() if name in after[kind]]
        for kind, rows in before.items()
        if kind in after
    }
    for kind, each in (*pairs.items(), ("all", [pair for rows in pairs.values() for pair in rows])):
        cells = ""
        for index in (0, 1):
            gained, lost = (sum(b[index] > a[index] for a, b in rows) for rows in (each, [(b, a) for a, b in each]))
            was = sum(a[index] for a, _ in each)
            cells += f" {was:5d} {was + gained - lost:5d} {f'+{gained} -{lost}':>9s} {sign_test(gained, lost):6.3f}"
        moved: dict[int, list[float]] = defaultdict(list)
        for old, new in each:
            if old[3] and new[3] and old[2] == new[2]:
                places = np.array(old[3]), np.array(new[3])
                size = places[0].shape[1]
                moved[size] += (UNITS[size] * np.linalg.norm(places[1] - places[0], axis=1)).tolist()
        far = [f"{1e3 * np.percentile(moved[3], 99):.1f} mm"] if moved[3] else []
        far += [f"{np.percentile(moved[2], 99):.1f} px"] if moved[2] else []
        lines.append(f"{kind:50s} {len(each):6d}{cells}   {' '.join(far)}")
    return "\n".join(lines)


def changes(before: dict[str, dict[str, Verdict]], after: dict[str, dict[str, Verdict]]) -> list[str]:
    """Return a line for each frame that became right or wrong in the image, or by the strict rule."""
    return [
        f"{kind}: {name}: right {old[0]} -> {new[0]}, in the image {old[1]} -> {new[1]}, chains {old[2]} -> {new[2]}"
        for kind, rows in before.items()
        for name, old in rows.items()
        if (new := after.get(kind, {}).get(name)) and new[:2] != old[:2]
    ]


def main(arguments: list[str] | None = None) -> int:
    """Record or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=("record", "compare"))
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE")
    parser.add_argument("--data", type=Path)
    parser.add_argument("--cache", type=Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--list", action="store_true", help="name the frames that changed")
    given = parser.parse_args(arguments)
    chosen = [work for work in works(given.data, given.cache) if given.only in work.kind]
    if len(given.files) > (1 if given.action == "record" else 2):
        parser.error("record takes one file, compare two at most")
    with TemporaryDirectory() as place:
        now = given.files[-1] if given.action == "record" or len(given.files) == 2 else Path(place, "now.json.xz")
        found = record(now, chosen, given.workers)
    if given.action == "compare":
        old = json.loads(lzma.open(given.files[0]).read())
        print("\n".join([*(changes(old, found) if given.list else ()), summary(old, found)]))  # noqa: T201
    return 0


if __name__ == "__main__":
    sys.exit(main())
