"""Draw the comparison of the 3-D and the 2-D mode: the chains of both over the image, circled where they differ."""

from collections.abc import Sequence

import numpy as np

from ..types import Array, Floats, Frame
from .backdrop import backdrop_of
from .canvas import Canvas
from .palette import CHAINS, DARK, Rgb, line_unit
from .writing import write_legend

COLOR_3D, COLOR_2D = CHAINS[0], CHAINS[1]
CIRCLE_COLOR: Rgb = (255, 60, 60)
MIN_CIRCLE_RADIUS = 14.0  # px at unit size


def draw_comparison(
    data: Frame,
    chains_3d: Sequence[Floats],
    chains_2d: Sequence[Floats],
    differences: Sequence[tuple[tuple[float, float], float]],
) -> Array:
    """Draw the chains that doo3d finds from depth (3-D mode) over those that it finds in the image alone (2-D mode).

    Chains of the 3-D mode are thin and blue, those of the 2-D mode wide and orange. Positions where they differ are circled in
    red. A legend is in the upper left corner, unless the image is too small.

    Parameters
    ----------
    data
        the frame, on whose color image (or shaded depth) the chains are drawn.
    chains_3d, chains_2d
        (N + 1, 2) px for each chain of N segments, its joints in the image.
    differences
        ((x, y), tolerance) px for each position where the modes differ, as in `Difference.at` and `Difference.tolerance`. The
        circle has a radius of 2.5 tolerances, at least 14 px.

    Returns
    -------
    (H, W, 3) uint8 RGB
        of the frame's size.
    """
    image = backdrop_of(data).image
    height, width = image.shape[:2]
    unit = line_unit(image)
    canvas = Canvas(height, width)
    for at, tolerance in differences:
        radius = max(MIN_CIRCLE_RADIUS * unit, 2.5 * tolerance)
        canvas.disc(np.array(at), radius + 3.4 * unit, DARK, 0.8)
        canvas.disc(np.array(at), radius + 2.4 * unit, CIRCLE_COLOR, 1.0)
    for at, tolerance in differences:
        canvas.disc(np.array(at), max(MIN_CIRCLE_RADIUS * unit, 2.5 * tolerance), DARK, 0.0)
    for lines, color, line_width in ((chains_2d, COLOR_2D, 5.0), (chains_3d, COLOR_3D, 1.8)):
        for line in lines:
            canvas.line(line, DARK, 0.6, (line_width + 1.6) * unit)
            canvas.line(line, color, 1.0, line_width * unit)
            canvas.disc(line[0], 1.6 * line_width * unit, color, 1.0)
    picture = canvas.blend_over(image)
    write_legend(picture, [("3-D, projected", COLOR_3D), ("2-D", COLOR_2D)])
    return picture
