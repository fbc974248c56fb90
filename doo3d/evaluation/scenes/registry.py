"""Build scenes by family name and seed."""

import zlib
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.random import Generator

from . import families, harnesses, tough_families, tubes, without
from . import handled_families as handled
from . import hard_families as hard
from . import wound_families as wound
from .model import Scene

Builder = Callable[[Generator, tuple[int, int]], "Scene | None"]

BASIC = "straight open crossing crossings occluded air several clutter tangle hairpin shiny thin far knots".split()
MORE = "gripper hook coil bundle two_radii hose wire plugs striped ring leaving touch figure_eight".split()
_BUILDERS: dict[str, Builder] = {
    **families.PLAIN,
    **{
        builder.__name__: builder
        for builder in (
            *(families.straight, families.occluded, families.air, families.several),
            *(hard.clutter, hard.hairpin, hard.shiny, hard.thin),
            *(handled.gripper, handled.hook, handled.plugs, handled.striped, handled.leaving, handled.touch),
            *(wound.coil, wound.bundle, wound.two_radii, wound.ring, wound.figure_eight, wound.knots),
        )
    },
}
FAMILIES = {name: _BUILDERS[name] for name in (*BASIC, *MORE)}
"""Families of scenes with cables: name -> builder."""

WITHOUT = without.WITHOUT
"""Families of scenes without a cable: name -> builder. The correct detection has no chain."""

TOUGH = tough_families.TOUGH
"""Families of scenes modelled on the hard ones of other generators: name -> builder."""

GROUPS = {"all": tuple(FAMILIES), "basic": tuple(BASIC), "more": tuple(MORE), "without": tuple(WITHOUT), "tough": tuple(TOUGH)}
"""Name of a group -> its families: all with cables, basic ones, handled and wound cables, none with a cable, and tough ones."""

TREES = harnesses.TREES
"""The families of branched objects: name -> builder."""

MOTION = "tree_motion"
"""The family of measured branched cables, read from a file of motion capture."""

TUBES = "tubes"
"""The family whose scenes are read from a file."""

FIRST_COUNTED_SEED = 1000
"""First seed of the frames that are counted only: nobody inspects them, so that the method is not tuned to them."""

MAX_ATTEMPTS = 4000
"""Greatest number of attempts to draw a scene before an error is raised."""


def family_rng(family: str, seed: int) -> Generator:
    """Return a random number generator for a family of scenes and a seed; the same name and seed give the same numbers."""
    return np.random.default_rng([zlib.crc32(family.encode()), seed])


def make_scene(family: str, seed: int, size: tuple[int, int] = (1280, 720)) -> Scene:
    """Return a scene with known truth; the same arguments give the same scene.

    Parameters
    ----------
    family
        name of a kind of scene such as "crossing" (a key of FAMILIES), of branched object (a key of TREES), of scene without a
        cable (a key of WITHOUT) or of tough scene (a key of TOUGH); "tubes:" and the path of a text file of tubes, in the format
        that `read_tubes` reads; or "tree_motion:" and the path of a motion capture, in the format that `motion_tree` reads.
    seed
        integer, 0 or more.
    size
        (width, height) px of the image.

    Raises
    ------
    ValueError : there is no such family.
    RuntimeError : no scene of this family fits an image of this size.
    InputError : the file of tubes cannot be read, or is not a tube configuration.
    """
    family, _, path = family.partition(":")
    readers: dict[str, Callable[..., Scene | None]] = {TUBES: tubes.tubes, MOTION: harnesses.motion_tree}
    known = FAMILIES | TREES | WITHOUT | TOUGH
    if family not in known and not (family in readers and path):
        raise ValueError(f"no scene family {family!r}: there are {', '.join(known)}, {TUBES}:FILE and {MOTION}:FILE")
    builder = partial(readers[family], path) if family in readers else known[family]
    rng = family_rng(family + Path(path).stem, seed)
    for _ in range(MAX_ATTEMPTS):
        scene = builder(rng, size)
        if scene is not None:
            name = f"{family}_{Path(path).stem + '_' if path else ''}{seed:03d}"
            return replace(scene, name=name, family=family, seed=seed)
    raise RuntimeError(f"scene family {family!r}, seed {seed}: nothing fits an image of {size[0]}x{size[1]}")
