"""Costs that several readings of a place share, in the units of merging: 1 per mm (1 per px in 2-D), 100 per radian."""

MISFIT_COST = 300.0
"""Cost units of what does not fit a reading: per sum of both radii between the distance of two axes and the one wanted (0 for a
branch, one sum for a crossing), and where a strand should continue smoothly, per radian of its bend and per e-fold (logarithm of
the ratio) by which its radius changes."""

TURN_COST = 100.0
"""Cost units per radian of a turn, as `merge.direction_weight` of a cable."""

TIP_COST = 120.0
"""Cost units of leaving an end free: an end is attached to a strand if the attachment costs less."""

NEARNESS_COST, MISS_COST = 0.5, 20.0
"""Cost units per mm (per px in 2-D) from an end to an axis, and per sum of radii by which its continuation misses the axis. They
choose, among the positions on a strand that fit an end, the nearest and straightest ahead."""

BRANCH_COST = 60.0
"""Cost units of a branch where two strands might cross instead, or where merging has joined its end to another."""

JOIN_COST = 250.0
"""Cost units up to which two ends of a cloud are joined across a gap, or two elbows bridged; a connection that costs as much has
no confidence."""
