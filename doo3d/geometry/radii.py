"""Define lengths in radii of the object, from two adjacent cross-sections."""

import numpy as np

STEP_RADII = 0.5
"""Distance between samples along a strand or a gap, and edge of a voxel, in radii: details of a radius need two samples
(Nyquist). Finer voxels keep adjacent strands apart, coarser ones bridge holes."""

OWN_RADII = 1.5
"""Distance from an axis, in radii, within which surface belongs to the strand: half way between its surface, at 1, and the
axis of a neighbor, at 2."""

TOUCHING_RADII = 2.2
"""Largest distance between two axes, in radii, at which surfaces touch: 2, and a tenth for the errors of both."""

ACROSS_RADII = np.array((-STEP_RADII, 0, STEP_RADII))
"""Lateral offsets from an axis, in radii, at which images are read."""

NODE_RADII = 3.0
"""Distance from a junction or a tip, in radii of the strand, within which everything belongs to it: a crossing in the view, a
second junction, a remainder of a strand, a branch at the tip of its trunk. Detected trees are scored with the same
distance."""

CORE_OFFSETS = 0.4 * np.array((-1, 0, 1))
"""Lateral offsets, in half-widths, that are certainly on the strand: away from its silhouette, where its surface falls away."""
