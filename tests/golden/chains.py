"""Check that a change of the code leaves every result as it was, byte for byte.

    python tests/golden/chains.py compare            # against chains.json, with a line per case that differs
    python tests/golden/chains.py record             # write chains.json anew; look at its diff before committing it

The cases are the samples; every rendered scene family with SEEDS seeds, once with the mask and the number of objects
given and once with nothing given; the sample photographs with both 2-D presets; and labelled photographs where
`--photos` names a folder that holds mbest/ and cset/. For each case the file keeps a digest of the chains' float64
arrays and a short summary that tells a moved joint from a lost chain. Digests hold on one kind of machine only: linear
algebra differs in the last bit between processors, which the summaries bear and the digests do not.

`--seeds N` takes fewer seeds, `--only TEXT` the cases whose names hold it, `--cache FOLDER` keeps rendered frames.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import pickle
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from doo3d import Detection, detect, load_config
from doo3d.evaluation.photos.datasets import cset, mbest
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.registry import GROUPS, make_scene
from doo3d.inputs import open_capture

HERE = Path(__file__).parent
FILE = HERE / "chains.json"
SAMPLES = HERE.parents[1] / "sample_clouds"
SEEDS = 10
GUARDED = GROUPS["basic"]
CAPTURES = ("crossing", "helix", "occluder", "straight", "two_cables", "clouds", "bags/crossing")
PHOTO_PRESETS = ("image", "paper_2d")
MOVED = 1e-5
"""Metres or pixels by which the mean of a chain's joints may differ between machines: of the rendered scenes, whose rays a
library casts, one differed by 4e-6 m between two processors, by the same code."""

Case = tuple[str, Callable[[], Detection]]


def samples() -> Iterator[Case]:
    """Every frame of the samples, found by the default configuration, or by both 2-D presets."""
    for name in CAPTURES:
        for frame in open_capture(SAMPLES / name).frames:
            yield f"samples/{name}/{frame.name}", partial(_sample, frame, "default")
    for frame in open_capture(SAMPLES / "photos").frames:
        for preset in PHOTO_PRESETS:
            yield f"samples/photos/{frame.name}/{preset}", partial(_sample, frame, preset)


def _sample(frame: Any, preset: str) -> Detection:
    loaded = frame.load()
    return detect(loaded.data, load_config(preset), loaded.mask)


def scenes(seeds: int, cache: Path | None) -> Iterator[Case]:
    """Every family, with all that can be said given, and with nothing."""
    for family in GUARDED:
        for seed in range(seeds):
            for given in (True, False):
                name = f"scenes/{family}/{seed}/{'given' if given else 'nothing'}"
                yield name, partial(_scene, family, seed, cache, given)


def _scene(family: str, seed: int, cache: Path | None, given: bool) -> Detection:
    frame, mask, count = _rendered(family, seed, cache)
    return detect(frame, load_config("default", {"merge.chains": count} if given else {}), mask if given else None)


def _rendered(family: str, seed: int, cache: Path | None) -> tuple[Any, Any, int]:
    """The frame, its mask and the number of objects: the rendered arrays from `cache` where they are."""
    from doo3d import Camera, Frame

    path = cache / f"{family}_{seed}.pkl" if cache else None
    if path is None or not path.exists():
        scene = render(make_scene(family, seed))
        frame, mask, count = scene.frame, scene.mask, max(1, len(scene.truths))
        if path is None:
            return frame, mask, count
        camera = [getattr(frame.camera, name) for name in ("fx", "fy", "cx", "cy", "width", "height")]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps((np.array(frame.color), np.array(frame.depth), camera, frame.name, np.array(mask), count)))
    color, depth, camera, name, mask, count = pickle.loads(path.read_bytes())
    return Frame(color, depth, Camera(*camera), name), mask, count


def photos(folder: Path) -> Iterator[Case]:
    """Labelled photographs of other people, where they are at hand."""
    for name, read, kinds in (("mbest", mbest, ("labels",)), ("cset", cset, ("labels", "network"))):
        for masks in kinds:
            for entry in read(folder / name, masks):
                for preset in PHOTO_PRESETS:
                    yield f"{name}/{masks}/{entry.family}/{entry.name}/{preset}", partial(_photo, entry, preset)


def _photo(entry: Any, preset: str) -> Detection:
    photo = entry.load()
    return detect(photo.image, load_config(preset), photo.mask)


def outcome(detection: Detection) -> dict[str, Any]:
    """What is kept of a detection: digests of every bit, and what a reader sees of a difference."""
    chains, confidence = hashlib.sha256(), hashlib.sha256()
    for chain in detection.chains:
        for array in (chain.joints, chain.radii, chain.occluded, np.array([chain.radius, chain.segment_length, chain.closed])):
            chains.update(np.ascontiguousarray(array).tobytes())
        for connection in chain.connections:
            chains.update(np.int64(connection.segment).tobytes())
            confidence.update(np.float64(connection[1]).tobytes())
    for crossing in detection.crossings:
        chains.update(np.array([*crossing.upper, *crossing.lower], dtype=np.int64).tobytes())
        chains.update(np.ascontiguousarray(crossing.point).tobytes())
    kept = [[len(chain.joints), *np.round(chain.joints.mean(axis=0), 9).tolist()] for chain in detection.chains]
    return {"chains": chains.hexdigest()[:16], "confidence": confidence.hexdigest()[:16], "joints": kept}


def difference(old: dict[str, Any] | None, new: dict[str, Any]) -> str:
    """What changed, in words; nothing where nothing did."""
    if old is None:
        return "is new"
    if old["chains"] == new["chains"]:
        return "" if old["confidence"] == new["confidence"] else "confidence changed"
    if [row[0] for row in old["joints"]] != [row[0] for row in new["joints"]]:
        return f"joints of the chains: {[row[0] for row in old['joints']]} before, {[row[0] for row in new['joints']]} now"
    moved = max((np.abs(np.array(a) - np.array(b)).max() for a, b in zip(old["joints"], new["joints"], strict=True)), default=0)
    return f"a chain's mean joint moved by {moved:.3g}" if moved else "a last bit, a flag or a crossing changed"


def cases(seeds: int = SEEDS, folder: Path | None = None, cache: Path | None = None) -> Iterator[Case]:
    """All cases; those of photographs only where `folder` is given."""
    yield from samples()
    yield from scenes(seeds, cache)
    if folder is not None:
        yield from photos(folder)


def main(arguments: list[str] | None = None) -> int:
    """Record or compare; 1 where a case differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=("compare", "record"))
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--only", default="")
    parser.add_argument("--photos", type=Path)
    parser.add_argument("--cache", type=Path)
    chosen = parser.parse_args(arguments)
    known = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    found: dict[str, Any] = {}
    changed = 0
    for name, run in cases(chosen.seeds, chosen.photos, chosen.cache):
        if chosen.only not in name:
            continue
        found[name] = outcome(run())
        said = difference(known.get(name), found[name])
        if said:
            changed += 1
            print(f"{name}: {said}", flush=True)  # noqa: T201
    print(f"{len(found)} cases, {changed} differ")  # noqa: T201
    if chosen.action == "record":
        rows = [f"{json.dumps(name)}: {json.dumps(value)}" for name, value in (known | found).items()]
        FILE.write_text("{\n" + ",\n".join(rows) + "\n}\n", encoding="utf-8", newline="\n")
        return 0
    return int(changed > 0)


if __name__ == "__main__":
    sys.exit(main())
