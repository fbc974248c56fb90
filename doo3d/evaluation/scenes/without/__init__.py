"""Build scenes without any deformable linear object, for which the correct detection has no chain.

The scenes hold no plain rods of 4 to 10 mm, which cannot be distinguished from a stiff cable. Each builder draws one scene from
the given random numbers.
"""

from collections.abc import Callable

from numpy.random import Generator

from ..model import Scene
from .hands import hands
from .rooms import office, shelves
from .tables import boards, prints, shadows
from .things import boxes, rubble
from .tools import tools

__all__ = ["WITHOUT"]

WITHOUT: dict[str, Callable[[Generator, tuple[int, int]], Scene]] = {
    builder.__name__: builder for builder in (tools, boxes, hands, shadows, boards, prints, shelves, office, rubble)
}
"""Families of scenes without a cable: name -> builder."""
