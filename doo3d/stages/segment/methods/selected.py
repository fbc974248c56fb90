"""What a method selects, with a note."""

from __future__ import annotations

from typing import NamedTuple

from ....types import Bools


class Selected(NamedTuple):
    """The pixels that a method selects, and a sentence about what it left out.

    Attributes
    ----------
    mask
        (H, W) bool.
    note
        the sentence; empty if there is nothing to say.
    """

    mask: Bools
    note: str = ""
