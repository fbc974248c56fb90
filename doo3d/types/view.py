"""The image in which a detection was found: its size, its camera, and the pixels of the object."""

from __future__ import annotations

import zlib
from base64 import b64decode, b64encode
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from .arrays import Array, Bools, Floats
from .data import Camera

SEEN, HIDDEN, OUTSIDE, NO_DEPTH = VISIBILITY = ("seen", "hidden", "outside the view", "no depth")
"""Words for a joint: it is seen; something hides it; its position is not in the image; it is seen, and its depth interpolated."""

FASTEST = 1  # of zlib: a mask becomes 1 to 4 kB, in less than a millisecond


@dataclass(frozen=True)
class View:
    """The image of one frame, as small as its detection, so that the detections of a long capture can be kept.

    Attributes
    ----------
    width, height
        size of the image, px.
    camera
        the intrinsics; None in 2-D.
    scale
        pixels of the image along the side of a pixel of the mask: over 1 if a large photograph was reduced.
    file
        the file of the instance labels that a run wrote, whose detection this is; None if the mask is here.
    numbers
        the label of each chain in that file.
    """

    width: int
    height: int
    camera: Camera | None = None
    scale: int = 1
    file: Path | None = None
    numbers: tuple[int, ...] = ()
    _mask: bytes | None = field(default=None, repr=False)
    _layers: bytes | None = field(default=None, repr=False)

    @staticmethod
    def of(mask: Bools, shape: Sequence[int], camera: Camera | None = None, layers: Array | None = None, scale: int = 1) -> View:
        """Return the view of a frame.

        Parameters
        ----------
        mask
            (H, W) bool, the pixels of the object; reduced by `scale`.
        shape
            (height, width, ...) of the image, px.
        camera, scale
            as the attributes.
        layers
            (H, W) uint8, the number of the color of the strand at each pixel, from 1, 0 for unknown; None or empty where colors
            say nothing.
        """
        colored = None if layers is None or not layers.size else zlib.compress(layers.tobytes(), FASTEST)
        bits = zlib.compress(np.packbits(mask).data, FASTEST)
        return View(shape[1], shape[0], camera, scale, _mask=bits, _layers=colored)

    @property
    def mask(self) -> Bools | None:
        """The pixels of the object, (H, W) bool; None if the detection was read from a file."""
        if self._mask is None:
            return None
        bits = np.frombuffer(zlib.decompress(self._mask), np.uint8)
        return self._enlarged(np.unpackbits(bits, count=int(np.prod(self._stored))).astype(bool))

    @property
    def layers(self) -> Array | None:
        """The number of the color of the strand at each pixel, (H, W) uint8, from 1, 0 for unknown; None for one color."""
        return None if self._layers is None else self._enlarged(np.frombuffer(zlib.decompress(self._layers), np.uint8))

    @property
    def _stored(self) -> tuple[int, int]:
        return -(-self.height // self.scale), -(-self.width // self.scale)

    def _enlarged(self, pixels: Array) -> Array:
        image = pixels.reshape(self._stored).repeat(self.scale, axis=0).repeat(self.scale, axis=1)
        return image[: self.height, : self.width]

    def kept(self, chains: Sequence[int]) -> View:
        """Return the view of a detection that keeps some of its chains; chains : their indices."""
        return replace(self, numbers=tuple(self.numbers[k] for k in chains)) if self.numbers else self

    def without(self, pixels: Bools) -> View:
        """Return the view without some pixels of its mask; pixels : (H, W) bool, True for those."""
        if (mask := self.mask) is None:
            return self
        left = (mask & ~pixels)[:: self.scale, :: self.scale]
        return replace(self, _mask=View.of(left, (self.height, self.width))._mask)

    def project(self, points: Floats) -> Floats:
        """Return the pixels of positions (N, D) in the camera's coordinates, (N, 2) px; NaN behind the camera."""
        return points if self.camera is None else self.camera.project(points)

    def is_outside(self, points: Floats) -> Bools:
        """Return which positions (N, D), in the camera's coordinates, are not in the image, (N,) bool."""
        pixels = self.project(points)
        return np.asarray(~((pixels > -0.5) & (pixels < (self.width - 0.5, self.height - 0.5))).all(axis=1))

    def to_dict(self, with_mask: bool = False) -> dict[str, Any]:
        """Return size and intrinsics, px, ready for JSON: "width", "height", and with a camera "fx", "fy", "cx", "cy".

        with_mask : True adds "mask" and "layers", compressed, which `from_dict` reads back.
        """
        names = () if self.camera is None else ("fx", "fy", "cx", "cy")
        values = {"width": self.width, "height": self.height} | {name: getattr(self.camera, name) for name in names}
        pixels = {"mask": self._mask, "layers": self._layers} if with_mask else {}
        return values | {name: b64encode(packed).decode("ascii") for name, packed in pixels.items() if packed is not None}

    @staticmethod
    def from_dict(values: dict[str, Any], file: Path | None = None, chains: int = 0) -> View:
        """Return the view that `to_dict` wrote; file : the labels of so many `chains`, if there are any."""
        size = {name: int(values[name]) for name in ("width", "height")}
        numbers = {name: float(values[name]) for name in ("fx", "fy", "cx", "cy") if name in values}
        mask, layers = (b64decode(values[name]) if name in values else None for name in ("mask", "layers"))
        camera = Camera(**numbers, **size) if numbers else None  # type: ignore[arg-type]
        return View(**size, camera=camera, file=file, numbers=tuple(range(1, chains + 1)), _mask=mask, _layers=layers)
