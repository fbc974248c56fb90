"""Branched objects: where strands of one body meet, decided against crossing, touching and ending near each other."""

from .branches import Branched, find_branches

__all__ = ["Branched", "find_branches"]
