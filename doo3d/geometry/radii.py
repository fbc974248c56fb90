"""Lengths in radii of the object that several steps share: they follow from the cross-section of two strands side by side."""

import numpy as np

STEP_RADII = 0.5
"""Radii between samples along a strand or a gap, and edge of a voxel: details of a radius need two samples (Nyquist). Finer
voxels keep strands side by side apart, coarser ones bridge holes."""

OWN_RADII = 1.5
"""Radii from an axis within which surface is the strand's own: half way between its own, at 1, and the axis of a
neighbor, at 2."""

TOUCHING_RADII = 2.2
"""Radii between two axes up to which surfaces touch: 2, and a tenth for the errors of both."""

ACROSS_RADII = np.array((-STEP_RADII, 0, STEP_RADII))
"""Radii to the side of an axis at which the images are read."""

NODE_RADII = 3.0
"""Distance from a junction or a tip, in radii of the strand, within which all belongs to it: a crossing in the view, a second
junction, a rest of a strand, a branch at the tip of its trunk. Detected trees are scored with the same distance."""

CORE_OFFSETS = 0.4 * np.array((-1, 0, 1))
"""Lateral offsets, in half-widths, that are on the strand for certain: away from its silhouette, where its surface falls away."""
