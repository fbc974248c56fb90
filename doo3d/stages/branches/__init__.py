"""Find the junctions of branched objects: at each contact, a branch competes with a crossing, a touch and a free end."""

from .branches import Branched, find_branches
from .leftovers import part_leftovers

__all__ = ["Branched", "find_branches", "part_leftovers"]
