"""Draw the strands that detection finds into the image, and compare those found with different settings."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from ...config import Config
from ...pipeline import detect
from ...types import Bools, Chain, Floats, Frame, Image
from ...types.display import DOUBTFUL_CONFIDENCE, length_text
from .thin_object import ThinObject

MIN_FOLLOWED = 0.9
"""Least fraction of a strand's joints that one chain must follow; a chain that ends at a crossing, or a few segments early, has
lost part of the strand."""


@dataclass(frozen=True)
class Strand:
    """A chain with its position in the image.

    Attributes
    ----------
    chain
        the chain, m (px in 2-D).
    pixels
        (K, 2) px, its joints in the image.
    thin
        the pixels of the parts that were seen.
    """

    chain: Chain
    pixels: Floats
    thin: ThinObject

    @property
    def is_doubtful(self) -> bool:
        """Whether the confidence of the chain is low."""
        return self.chain.confidence < DOUBTFUL_CONFIDENCE

    def __str__(self) -> str:
        """Return the length of the strand, and a pixel in its middle."""
        x, y = np.rint(self.pixels[len(self.pixels) // 2]).astype(int).tolist()
        return f"{length_text(self.chain.length, self.chain.joints.shape[1] == 2)} long, through {x},{y}"


def find_strands(data: Frame | Image, config: Config) -> list[Strand]:
    """Return the chains that detection finds in a frame or an image, longest first."""
    return [drawn(chain, data) for chain in detect(data, config).chains]


def drawn(chain: Chain, data: Frame | Image) -> Strand:
    """Return a chain as a strand, with its seen segments drawn at their width in the image."""
    shape = data.color.shape[:2] if isinstance(data, Image) else data.depth.shape
    pixels, half_widths = chain.joints, np.full(len(chain.joints), chain.radius)
    if isinstance(data, Frame):
        half_widths = half_widths * data.camera.fx / chain.joints[:, 2]
        pixels = data.camera.project(chain.joints)
    mask, seen = np.zeros(shape, np.uint8), np.flatnonzero(~chain.occluded)
    points, widths = np.rint(pixels).astype(int), np.maximum(np.rint(2 * half_widths), 1).astype(int)
    for k in seen.tolist():
        cv2.line(mask, points[k].tolist(), points[k + 1].tolist(), 1, int(widths[k]))
    length = float(np.linalg.norm(np.diff(pixels, axis=0), axis=1).sum())
    return Strand(chain, pixels, ThinObject(mask > 0, 1.0, length, float(np.median(half_widths))))


def lost_strands(strands: Sequence[Strand], found: Sequence[Strand]) -> list[Strand]:
    """Return the strands that no strand of `found` follows from end to end."""

    def is_followed(strand: Strand) -> bool:
        return any(np.mean(_at(other.thin.mask, strand.pixels)) >= MIN_FOLLOWED for other in found)

    return [strand for strand in strands if not is_followed(strand)]


def _at(mask: Bools, pixels: Floats) -> Bools:
    """Return which pixel positions (K, 2) px are in a mask, (K,) bool; False outside the image."""
    u, v = np.rint(pixels).astype(int).T
    inside = (u >= 0) & (v >= 0) & (u < mask.shape[1]) & (v < mask.shape[0])
    return np.asarray(inside & mask[np.where(inside, v, 0), np.where(inside, u, 0)])
