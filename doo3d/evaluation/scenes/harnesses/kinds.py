"""Define the kinds of harnesses, one for each family of scenes."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Kind:
    """The properties of a family of harnesses.

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
        whether two branches leave the trunk at the same place, on opposite sides.
    touching
        whether a separate cable ends at the side of a strand.
    under
        whether a branch that crosses the trunk passes under it; otherwise over or under at random.
    wide
        whether the box also hides some centimetres of each strand at the junction.
    swapping
        whether two strands run side by side and swap sides; `plan_swap` then sets branches and crossings.
    two
        whether there are two harnesses, which cross each other but not themselves.
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
