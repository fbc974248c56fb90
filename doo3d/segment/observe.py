"""From what was captured to the scene that the stages ask."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..config import Config
from ..errors import InputError
from ..scene.masked import MaskedScene
from ..types import Array, Chain, Cloud, Frame, Image, View
from ..types.stopwatch import timed
from .extend_mask import extend_mask
from .segment import segment, segment_extended
from .segmentation import Segmentation
from .working_picture import segment_config, segment_picture

MASK_EXTENSIONS = 3
"""Times at most that the mask is extended and the chains are found again."""

MAX_EXTENDED_CHAINS = 30
"""Chains at most along which the mask is extended: following each, and all stages again, take a second or more beyond that."""

EXTENSION_NOTE = "extend_mask: {} chains were found, so the mask is not extended along them; that is done for at most {}"


@dataclass(frozen=True)
class Observed:
    """A segmented frame.

    Attributes
    ----------
    segmentation
        the scene, and how many pixels or points were dropped and why.
    data
        the frame, cloud or image; a large photograph reduced.
    config
        the settings in the pixels of `data`.
    scale
        pixels of the photograph along the side of a pixel of `data`: over 1 if it was reduced (`segment.working_width`).
    extensions
        how many times the mask was extended along the chains found in it.
    """

    segmentation: Segmentation
    data: Frame | Cloud | Image
    config: Config
    scale: int = 1
    extensions: int = 0

    def extended(self, chains: list[Chain]) -> Observed | None:
        """Return the frame segmented again, its mask extended along strands that continue beyond it.

        None where no strand does, and after MASK_EXTENSIONS (3) times. chains : those found in the mask, px.
        """
        if self.extensions == MASK_EXTENSIONS or len(chains) > MAX_EXTENDED_CHAINS:
            return None
        mask = extend_mask(chains, self.segmentation.scene.with_settings(self.config))
        if mask is None:
            return None
        segmentation = _segment_again(self.data, self.config, mask, self.segmentation)
        return replace(self, segmentation=segmentation, extensions=self.extensions + 1)

    def view(self, data: Frame | Cloud | Image) -> View | None:
        """Return the image with the mask that segmentation decided on; None for a cloud. data : the frame as captured."""
        scene = self.segmentation.scene
        if isinstance(data, Cloud) or not isinstance(scene, MaskedScene):
            return None
        shape, camera = (data.depth.shape, data.camera) if isinstance(data, Frame) else (data.color.shape, None)
        return View.of(scene.whole.mask, shape, camera, scene.colors, self.scale)

    def note(self, chains: list[Chain]) -> tuple[str, ...]:
        """Return the note that there were too many chains to extend the mask along them."""
        is_asked = self.config.extend_mask.max_length and self.extensions < MASK_EXTENSIONS
        many = is_asked and len(chains) > MAX_EXTENDED_CHAINS
        return (EXTENSION_NOTE.format(len(chains), MAX_EXTENDED_CHAINS),) if many else ()


@timed("segment")
def observe(data: Frame | Cloud | Image, config: Config, mask: Array | None = None) -> Observed:
    """Segment a frame, cloud or image, a large photograph in a smaller copy.

    Parameters
    ----------
    data
        what was captured.
    config
        the settings.
    mask
        the caller's own segmentation, (H, W) or (N,) bool; None segments as the settings say.

    Raises
    ------
    InputError : the data cannot be used. It names the frame, unless its name is the default of its type.
    """
    try:
        if isinstance(data, Image):
            return Observed(*segment_picture(data, config, mask))
        return Observed(segment(data, segment_config(config), mask, config.seed), data, config)
    except InputError as error:
        if data.name == type(data).__name__.lower():
            raise
        raise InputError(f"frame {data.name}: {error}", code=error.code) from None


@timed("segment")
def _segment_again(data: Frame | Cloud | Image, config: Config, mask: Array, base: Segmentation) -> Segmentation:
    return segment_extended(data, segment_config(config), mask, base)
