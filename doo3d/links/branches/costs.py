"""Costs that several readings of a place share, in the units of merging: 1 per mm (1 per px in 2-D), 100 per radian."""

MISFIT_COST = 300.0
"""Cost units of what does not fit a reading: per sum of both radii between the distance of two axes and the one wanted (0 for a
branch, one sum for a crossing)."""

TURN_COST = 100.0
"""Cost units per radian of a turn, as `merge.direction_weight` of a cable."""

TIP_COST = 120.0
"""Cost units of leaving an end free: an end is attached to a strand if the attachment costs less."""

MISS_COST = 20.0
"""Cost units per sum of radii by which the continuation of an end misses the axis. It chooses, among the positions on a strand
that fit an end, the one straightest ahead."""

BRANCH_COST = 60.0
"""Cost units of a branch where two strands might cross instead, or where merging has joined its end to another."""

JOIN_COST = 250.0
"""Cost units up to which two ends of a cloud are joined across a gap; a connection that costs as much has
no confidence."""
