"""Build scenes of branched objects: harnesses on a table or hanging, partly hidden, crossing, or touched by a cable.

Each builder draws one scene from the given random numbers, or returns None if the draw cannot be built.
"""

from functools import partial

from .build import harness
from .kinds import KINDS, Kind
from .motion import motion_tree, read_markers

__all__ = ["KINDS", "TREES", "Kind", "harness", "motion_tree", "read_markers"]

TREES = {name: partial(harness, kind) for name, kind in KINDS.items()}
"""Families of scenes of branched objects: name -> builder."""
