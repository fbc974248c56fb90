"""Render the benchmark's own data: frames, sequences, harnesses and bundles, each with train, test and a card."""

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import NamedTuple

from ..benchmark.cases import known_frame
from ..rendering.renderer import render
from ..sample_captures import Writer, write_rendered
from ..scenes.registry import FAMILIES, TREES, make_scene
from ..sequences.motions import OWN_MOTIONS
from ..sequences.scenes import make_sequence

FIRST_SEED = {"train": 5000, "test": 6000}
"""Part of a set -> seed of its first scene; scenes of the two parts, and of doo3d's own development, are different."""

SEQUENCE_FRAMES = 45
"""Number of frames of a sequence, 30 a second."""

TREES_FILE = "trees.json"


class Set(NamedTuple):
    """One of the benchmark's own data sets: content, families, default number of scenes of each, form of the truth."""

    content: str
    families: tuple[str, ...]
    seeds: int
    truth: str


_SPLIT = "A cable that leaves the image\n  and returns is a cable for each piece in the image, of one number in `instances/`."
_WHOLE = "Cables are whole, with what lies\n  outside the image."

SETS = {
    "frames": Set("One to five cables that lie on a table, hang, cross, or are held.", tuple(FAMILIES), 3, _SPLIT),
    "sequences": Set("One cable in motion; hands pass in front of it, and depth is lost.", tuple(OWN_MOTIONS), 1, _WHOLE),
    "harness": Set(
        "Branched cables; a strand from junction to junction is a cable.",
        tuple(TREES),
        4,
        f"{_WHOLE} `{TREES_FILE}`: the `nodes` (m) and\n  `edges` (cable, node, node) of each object.",
    ),
    "bundles": Set(
        "Cables side by side, wound round each other, or touching.", ("bundle", "tough_bundle", "touch", "tangle"), 8, _SPLIT
    ),
}
"""Name of a set -> its content."""

_CARD = """# {name}

{content} Rendered by doo3d {version}: `doo3d evaluate sets FOLDER --sets {name}{options}`.

- **Licence**: MIT. All scenes are made by random numbers; nothing is from other data.
- **Sizes**: {scenes} scenes a family and part, of {families}; {width}x{height} px. train: seeds from {train}; test: from {test}.
- **Files** of a capture: `color/` (JPEG), `depth/` (16 bit, mm, with the errors of a simulated RealSense D435), `mask/`,
  `instances/` (number of the cable at each pixel, from 1), `camera_intrinsic.json` (Open3D), `truth.json`.
- **Truth**: `frames`, by name: the list of cables. Of each, `axis` (P, 3) in m in the camera's optical frame, 1 mm apart;
  `radius` in m; `closed`, whether it is a ring; `seen`, whether the camera sees each point. {truth}
- **Scores**: `doo3d evaluate predictions PREDICTIONS --data {name}/test`.
"""


def set_writers(folder: Path, names: Sequence[str], seeds: int | None, size: tuple[int, int]) -> list[Writer]:
    """Return functions that write the captures and the cards of sets, each returning the path that it wrote.

    Parameters
    ----------
    folder
        output folder; a set is `<folder>/<set>/<train or test>/<family>_<seed>`, with the card `<folder>/<set>/README.md`.
    names
        names of sets, keys of SETS.
    seeds
        number of scenes of each family and part; None for the number of the set.
    size
        (width, height) px of the images.
    """
    writers: list[Writer] = []
    for name in names:
        count = seeds or SETS[name].seeds
        write = _write_sequence if name == "sequences" else _write_scene
        for (part, first), family, k in product(FIRST_SEED.items(), SETS[name].families, range(count)):
            writers.append(partial(write, folder / name / part / f"{family}_{first + k}", family, first + k, size))
        writers.append(partial(_write_card, folder / name, name, seeds, size))
    return writers


def _write_sequence(folder: Path, motion: str, seed: int, size: tuple[int, int]) -> Path:
    return write_rendered(folder, make_sequence(motion, seed, size, SEQUENCE_FRAMES).frames(), with_labels=True)


def _write_scene(folder: Path, family: str, seed: int, size: tuple[int, int]) -> Path:
    scene = make_scene(family, seed, size)
    rendered = render(scene)
    if not scene.trees:
        rendered = replace(rendered, truths=known_frame(rendered).truths)
    write_rendered(folder, [rendered], with_labels=True)
    if scene.trees:
        trees = [{"nodes": tree.nodes.round(4).tolist(), "edges": tree.edges} for tree in scene.trees]
        (folder / TREES_FILE).write_text(json.dumps(trees) + "\n", encoding="utf-8", newline="\n")
    return folder


def _write_card(folder: Path, name: str, seeds: int | None, size: tuple[int, int]) -> Path:
    from ... import __version__

    each, path = SETS[name], folder / "README.md"
    options = (f" --seeds {seeds}" if seeds else "") + f" --size {size[0]}x{size[1]}"
    values = {
        "name": name,
        "content": each.content,
        "version": __version__,
        "options": options,
        "scenes": seeds or each.seeds,
        "truth": each.truth,
    }
    values |= {"families": ", ".join(each.families), "width": size[0], "height": size[1]} | FIRST_SEED
    path.write_text(_CARD.format(**values), encoding="utf-8", newline="\n")
    return path
