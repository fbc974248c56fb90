"""The colors of chains: distinct, also for color-blind readers, and bright on any image."""

from __future__ import annotations

import colorsys

Rgb = tuple[int, int, int]

DARK: Rgb = (16, 18, 24)
LIGHT: Rgb = (255, 255, 255)
CHAINS: tuple[Rgb, ...] = (
    (0, 200, 255),
    (255, 138, 0),
    (255, 77, 184),
    (150, 226, 40),
    (255, 222, 60),
    (160, 120, 255),
    (0, 224, 164),
    (255, 86, 86),
)
_HUE_STEP = 0.618034  # golden ratio, in turns of hue between consecutive chains: never close to a recent one

UNIT_PX = 700.0  # square root of the area, px, of a picture with lines of unit width; larger pictures have wider lines


def chain_color(index: int) -> Rgb:
    """Return the color of a chain in all pictures: (red, green, blue), 0 to 255.

    Parameters
    ----------
    index
        number of the chain: its id if it has one, else its index in the detection. Consecutive numbers have distinct colors.
    """
    if index < len(CHAINS):
        return CHAINS[index]
    red, green, blue = colorsys.hls_to_rgb((index * _HUE_STEP) % 1.0, 0.62, 0.95)
    return round(red * 255), round(green * 255), round(blue * 255)
