"""Families of scenes as hard as those of other generators: strands that touch, cables in the air, depth of a wall behind them.

Each builder draws one scene in the camera's optical frame from the given random numbers, or returns None if the draw cannot be
built; then call it again with the same generator.
"""

from __future__ import annotations

from collections.abc import Callable

from numpy.random import Generator

from ..model import Scene
from .held import gripper, hook, wire
from .laid import bundle, coil, radii

__all__ = ["TOUGH"]

TOUGH: dict[str, Callable[[Generator, tuple[int, int]], Scene | None]] = {
    "tough_coil": coil,
    "tough_radii": radii,
    "tough_hook": hook,
    "tough_gripper": gripper,
    "tough_wire": wire,
    "tough_bundle": bundle,
}
"""Families of tough scenes: name -> builder."""
