"""Scenes by family name and seed."""

from __future__ import annotations

import zlib
from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from . import families
from .model import Scene

Builder = Callable[[Generator, tuple[int, int]], "Scene | None"]

FAMILIES: dict[str, Builder] = {
    "straight": families.straight,
    "open": families.open_curve,
    "crossing": families.crossing,
    "crossings": families.crossings,
    "occluded": families.occluded,
    "air": families.air,
    "several": families.several,
}
ATTEMPTS = 400  # draws of a scene before a family is given up


def family_rng(family: str, seed: int) -> Generator:
    """The random numbers of one scene."""
    return np.random.default_rng([zlib.crc32(family.encode()), seed])


def make_scene(family: str, seed: int, size: tuple[int, int] = (1280, 720)) -> Scene:
    """A scene of known truth; the same arguments give the same scene.

    Parameters
    ----------
    family : a key of FAMILIES.
    seed : 0 or more.
    size : (width, height) px of the image.

    Raises
    ------
    ValueError : no such family.
    RuntimeError : no scene of this family fits an image of this size.
    """
    if family not in FAMILIES:
        raise ValueError(f"no scene family {family!r}: there are {', '.join(FAMILIES)}")
    rng = family_rng(family, seed)
    for _ in range(ATTEMPTS):
        scene = FAMILIES[family](rng, size)
        if scene is not None:
            return replace_name(scene, family, seed)
    raise RuntimeError(f"scene family {family!r}, seed {seed}: nothing fits an image of {size[0]}x{size[1]}")


def replace_name(scene: Scene, family: str, seed: int) -> Scene:
    """The scene under its family's name and seed."""
    values = {**vars(scene), "name": f"{family}_{seed:03d}", "family": family, "seed": seed}
    return Scene(**values)
