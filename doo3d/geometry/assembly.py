"""Hold the pieces of one object in order, with the paths across their gaps."""

from dataclasses import dataclass

from ..types import Floats
from .gap_path import GapPath


@dataclass(frozen=True)
class Assembly:
    """The pieces (chains) of one object in order, before their gaps are filled.

    Attributes
    ----------
    pieces
        the joints of each piece of N segments, (N + 1, D) m, D = 3 (in 2-D: px, D = 2), in the order and direction of the
        object.
    gap_paths
        the path from each piece to the next; a closed object has one more, from the last piece to the first.
    closed
        True for a ring, whose last piece is linked to the first.
    confidence
        confidence of each link of two pieces, 0 to 1, in the order of the gaps. Empty for a single chain that already was a ring.
    """

    pieces: tuple[Floats, ...]
    gap_paths: tuple[GapPath, ...] = ()
    closed: bool = False
    confidence: tuple[float, ...] = ()

    @property
    def segments(self) -> int:
        """The number of segments of all pieces together."""
        return sum(len(piece) - 1 for piece in self.pieces)
