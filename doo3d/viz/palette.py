"""Define the colors and numbers of chains; colors are bright and distinct, also for color-blind readers."""

import colorsys
from typing import NamedTuple

import numpy as np

from ..types import Array, Chain, Detection
from ..types.display import doubt_text

Rgb = tuple[int, int, int]

DARK: Rgb = (16, 18, 24)
LIGHT: Rgb = (255, 255, 255)
CHAINS: tuple[Rgb, ...] = (
    (0, 204, 255),
    (238, 51, 0),
    (238, 221, 51),
    (136, 51, 255),
    (187, 238, 136),
    (255, 153, 170),
    (0, 119, 204),
    (187, 68, 68),
)
"""Colors of chains, RGB. Any two are at least 30 apart in CIELAB, with normal vision and with each type of color blindness."""
DOUBTFUL: Rgb = (176, 176, 176)
"""Color of doubtful chains, RGB: gray, unlike all other chains."""
DOUBTFUL_WIDTH = 0.55
"""Width of a doubtful chain's lines and tubes, as a fraction of that of other chains: visibly thinner, but still a line."""
_HUE_STEP = 0.618034  # golden ratio, in turns of hue between consecutive chains: never close to a recent one

UNIT_PX = 700.0  # square root of the area, px, of a picture with lines of unit width; larger pictures have wider lines


def line_unit(picture: Array) -> float:
    """Return the factor of all line widths for a picture (H, W, 3): 1 in small pictures, more in large ones."""
    return max(1.0, float(np.sqrt(picture.shape[0] * picture.shape[1])) / UNIT_PX)


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


class ChainStyle(NamedTuple):
    """The color and line width of a chain in pictures, figures, notebooks and the report.

    Attributes
    ----------
    color
        RGB, 0 to 255.
    width
        factor of the width of lines and tubes.
    doubt
        words for the legend, such as "doubtful (confidence 0.12)"; empty for a chain that is not doubtful.
    """

    color: Rgb
    width: float
    doubt: str

    @property
    def css(self) -> str:
        """The color as "#rrggbb"."""
        return "#{:02x}{:02x}{:02x}".format(*self.color)


def chain_style(chain: Chain, number: int) -> ChainStyle:
    """Return the style of a chain: the color of its number, or thin and gray if its confidence is below 0.5."""
    return doubtful_style(chain) if chain.is_doubtful else ChainStyle(chain_color(number), 1.0, "")


def doubtful_style(chain: Chain) -> ChainStyle:
    """Return the style of a chain of `detection.doubtful`: thin and gray, whatever its confidence."""
    return ChainStyle(DOUBTFUL, DOUBTFUL_WIDTH, doubt_text(chain.confidence))


def chain_styles(detection: Detection) -> list[ChainStyle]:
    """Return the style of each chain of a detection, in the order of `detection.chains`."""
    return [chain_style(chain, number) for chain, number in zip(detection.chains, chain_numbers(detection), strict=True)]


def all_chains(detection: Detection) -> list[tuple[Chain, ChainStyle, str]]:
    """Return each chain of a detection with its style and number, then the doubtful chains without numbers."""
    numbers = map(str, chain_numbers(detection))
    chains = list(zip(detection.chains, chain_styles(detection), numbers, strict=True))
    return [*chains, *((chain, doubtful_style(chain), "") for chain in detection.doubtful)]


def chain_numbers(detection: Detection) -> list[int]:
    """Return the number of each chain, in the order of `detection.chains`, as pictures show it and exported files name it.

    The numbers are the chains' ids, which tracking keeps from frame to frame. If any id is missing or occurs twice, the numbers
    are 0, 1, 2, ... instead.
    """
    ids = [chain.id for chain in detection.chains if chain.id is not None]
    return ids if len(set(ids)) == len(detection.chains) else list(range(len(detection.chains)))
