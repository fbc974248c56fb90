"""Lengths in radii of the object that several steps share: they follow from the cross-section of two strands side by side."""

import numpy as np

STEP_RADII = 0.5
"""Radii between samples along a strand or a gap: details of a radius need two samples (Nyquist), and voxels are as large."""

OWN_RADII = 1.5
"""Radii from an axis within which surface is the strand's own: half way between its own, at 1, and the axis of a
neighbor, at 2."""

TOUCHING_RADII = 2.2
"""Radii between two axes up to which surfaces touch: 2, and a tenth for the errors of both."""

CORE_OFFSETS = np.array((-0.4, 0.0, 0.4))
"""Lateral offsets, in half-widths, that are on the strand for certain: away from its silhouette, where its surface falls away."""
