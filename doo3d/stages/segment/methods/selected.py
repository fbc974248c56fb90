"""What a method selects, with a note."""

from __future__ import annotations

from typing import NamedTuple

from ....types import Bools, Plane


class Selected(NamedTuple):
    """The pixels that a method selects, a sentence about what it left out, and the plane behind them.

    Attributes
    ----------
    mask
        (H, W) bool.
    note
        the sentence; empty if there is nothing to say.
    plane
        the plane that the method found, its normal to either side; None if it looked for none, or found too few readings on it.
    """

    mask: Bools
    note: str = ""
    plane: Plane | None = None
