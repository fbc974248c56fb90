"""The colours of chains: far apart from each other, for colour-blind eyes too, and bright on any image."""

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
_GOLDEN = 0.618034  # of a turn of hue from one further chain to the next: never close to one just used


def chain_color(index: int) -> Rgb:
    """The colour of the chain `index`, RGB; beyond the hand-picked ones, hues a golden section apart."""
    if index < len(CHAINS):
        return CHAINS[index]
    red, green, blue = colorsys.hls_to_rgb((index * _GOLDEN) % 1.0, 0.62, 0.95)
    return round(red * 255), round(green * 255), round(blue * 255)
