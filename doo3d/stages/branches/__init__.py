"""Branched objects: where strands of one body meet, decided against crossing, touching and ending near each other."""

from .branches import Branched, find_branches
from .leftovers import part_leftovers

__all__ = ["Branched", "find_branches", "part_leftovers"]
