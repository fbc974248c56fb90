"""Find the junctions of branched objects: at each contact, a branch competes with a crossing, a touch and a free end."""

from .branches import Branched, find_branches, may_branch

__all__ = ["Branched", "find_branches", "may_branch"]
