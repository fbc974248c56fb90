"""The kinds of harnesses that families of scenes show."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Kind:
    """What a family of harnesses is like.

    Attributes
    ----------
    branches
        (least, greatest) number of branches.
    crossings
        (least, greatest) number of crossings.
    hanging
        whether the object hangs in the air and not on the table.
    hidden
        whether a box hides a junction.
    opposite
        whether two branches leave the trunk at one place, on both sides.
    touching
        whether a cable of its own ends at the side of a strand.
    under
        whether a branch passes under the trunk, rather than at random over or under.
    wide
        whether the box also hides some centimetres of each strand at the junction.
    swapping
        whether two strands run side by side and swap sides; branches and crossings are then those of `plan_swap`.
    two
        whether there are two harnesses, which cross each other only.
    """

    branches: tuple[int, int] = (1, 3)
    crossings: tuple[int, int] = (0, 0)
    hanging: bool = False
    hidden: bool = False
    opposite: bool = False
    touching: bool = False
    under: bool = False
    wide: bool = False
    swapping: bool = False
    two: bool = False


KINDS = {
    "tree": Kind(),
    "tree_crossing": Kind(crossings=(1, 1)),
    "tree_many": Kind(branches=(4, 6), crossings=(0, 2)),
    "tree_hanging": Kind(hanging=True, crossings=(0, 1)),
    "tree_hidden": Kind(hidden=True),
    "tree_under": Kind(crossings=(1, 1), under=True),
    "tree_opposite": Kind(branches=(2, 3), opposite=True),
    "tree_touch": Kind(touching=True),
    "tree_hanging_crossing": Kind(hanging=True, crossings=(1, 1)),
    "tree_hidden_wide": Kind(hidden=True, wide=True),
    "tree_swap": Kind(swapping=True),
    "tree_two": Kind(branches=(1, 2), crossings=(1, 3), two=True),
}
