"""Find the junctions of branched objects: at each contact, a branch competes with a crossing, a touch and a free end."""

from .branches import Branched, branch, branch_notes, find_branches

__all__ = ["Branched", "branch", "branch_notes", "find_branches"]
