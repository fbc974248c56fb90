"""Define the settings of segmentation."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import (
    Field,
    PlainSerializer,
    PositiveInt,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)

from ..plugins import SEGMENTERS, plugin_names
from .section import Section, expert

Hsv = tuple[int, int, int]


class HsvRange(Section):
    """A range of colors in OpenCV's 8-bit HSV: all colors between two corners, which are included, in hue, saturation and value.

    If the hue of `low` is above that of `high`, the hues run from `low` through red (179, then 0) to `high`.
    """

    low: Hsv = Field(
        description="Lower corner of the box, included: [hue 0 to 179, saturation 0 to 255, value 0 to 255]. A hue above "
        "the upper corner's selects the hues through red."
    )
    high: Hsv = Field(description="Upper corner of the box, included: [hue 0 to 179, saturation 0 to 255, value 0 to 255].")

    @model_validator(mode="after")
    def _inside(self) -> HsvRange:
        for name, triple in (("low", self.low), ("high", self.high)):
            for value, top, part in zip(triple, (179, 255, 255), ("hue", "saturation", "value"), strict=True):
                if not 0 <= value <= top:
                    raise ValueError(f"{name} {part} is {value}, expected 0 to {top} (OpenCV's 8-bit HSV)")
        for i, part in ((1, "saturation"), (2, "value")):
            if self.low[i] > self.high[i]:
                raise ValueError(f"low {part} {self.low[i]} is above high {part} {self.high[i]}")
        return self


def _with_plugins(value: Any, check: ValidatorFunctionWrapHandler) -> Any:
    """Accept the name of a plug-in as a method; the error for an unknown name lists the plug-ins, too."""
    try:
        return check(value)
    except ValidationError:
        names = plugin_names(SEGMENTERS)
        if value in names:
            return value
        if names:
            raise ValueError(f"{value!r} is no method: expected one of {', '.join((*get_args(_Method), *names))}") from None
        raise


_Method = Literal["auto", "hsv", "mask", "plane", "background", "everything", "ridge", "strands", "network", "onnx"]
Method = Annotated[_Method, WrapValidator(_with_plugins), PlainSerializer(str, return_type=str)]
"""Name of a segmentation method: one of doo3d's, or that of an installed plug-in."""


class OnnxConfig(Section):
    """Settings of the methods network and onnx: the user's own segmentation network, as an ONNX file."""

    model: str | None = Field(
        None,
        description="Your own segmentation network. Path of an ONNX file: from doo3d train for the method network, which has one "
        "of its own; any other, with one input (1, 3, height, width) and the output (1, classes, height, width), for the method "
        "onnx. Set it if you have trained one.",
    )
    input_size: tuple[PositiveInt, PositiveInt] | None = Field(
        None,
        description="Scale the color image to this size before the network. Width and height in pixels; null leaves it as it "
        "is. Set it to the size that the network was exported with.",
    )
    mean: tuple[float, float, float] = Field(
        (0.0, 0.0, 0.0),
        description="Subtract this from red, green and blue, 0 to 255. Set it as in training: ImageNet's mean is "
        "[123.7, 116.3, 103.5].",
    )
    scale: tuple[float, float, float] = Field(
        (1 / 255, 1 / 255, 1 / 255),
        description="Then multiply red, green and blue by this. Set it as in training: with ImageNet's deviations it is "
        "[0.0171, 0.0175, 0.0174].",
    )
    channels: Literal["rgb", "bgr"] = expert(
        "rgb", "Order of the colors in the network's input. Set bgr for a network trained on images read by OpenCV."
    )
    class_index: int = Field(
        0,
        ge=0,
        description="Class that is the object. Index from 0. Set it for a network of several classes, in which the class with "
        "the highest score wins.",
    )
    threshold: float = Field(
        0.5,
        description="Score above which a pixel is the object, for a network of one class. Set 0 if it ends without a sigmoid.",
    )


class SegmentConfig(Section):
    """Settings of segmentation, which decides which pixels or points are the object."""

    method: Method = Field(
        "auto",
        description="Method that separates the object from the rest. mask (the mask given), hsv (the colors in `ranges`), "
        "plane (whatever stands out of the dominant plane), background (whatever differs from `reference`), "
        "strands (bands of one width, distinct by color or raised from the plane), everything (all points), ridge (thin lines, "
        "2-D only), network (the rules of strands and a small network; your own by `onnx.model`, from `doo3d train`), "
        "onnx (any other network, `onnx.model`) or auto: the mask if "
        "one is given, else hsv if `ranges` are set, background if `reference` is set, "
        "network with a color image, otherwise plane if most of the scene is a broad surface, and everything if not; "
        "or the name of a method that a plug-in adds. Set it if auto chooses wrongly.",
    )
    ranges: tuple[HsvRange, ...] = Field(
        (),
        description="Color ranges of the object, for the method hsv; a pixel in any of them is selected. Boxes {low, "
        "high} of hue 0 to 179, saturation 0 to 255 and value 0 to 255 (OpenCV's 8-bit HSV); a low hue above "
        "the high one selects the hues through red. Set it for an object with a color of its own: `doo3d "
        "tune` proposes ranges.",
    )
    reference: str | None = Field(
        None,
        description="Image of the scene without the object, for the method background. Path of a depth image (16-bit PNG) "
        "or a color image of the frames' size. Set it if the camera and the scene do not move.",
    )
    reference_depth_scale: float = expert(
        1000.0,
        "Unit of the reference if it is a depth image. Depth units per metre, over 0. Change it if the depth is not in mm.",
        gt=0,
    )
    depth_difference: float = expert(
        0.004,
        "Select pixels that are at least this much nearer than the reference depth image, for the method background. "
        "m, over 0. Set it to a few times the depth noise.",
        gt=0,
    )
    color_difference: float = expert(
        30.0,
        "Select pixels whose color is at least this far from the reference color image, for the method background. "
        "Distance in 8-bit RGB, over 0, at most 442. Raise it under flickering light.",
        gt=0,
        le=442,
    )
    onnx: OnnxConfig = expert(
        OnnxConfig(),
        "Your own segmentation network. For the methods network (a file of doo3d train) and onnx (any other): "
        "`segment.onnx.model`, path of an ONNX file; `threshold`, the score above which a pixel is the object. For the method "
        "onnx: `input_size`, width and height that it takes, px; `mean` and `scale` of its input; `channels`, rgb or bgr; "
        "`class_index` of the object. Set them as the network was trained and exported.",
    )
    plane_distance: float = Field(
        0.003,
        gt=0,
        description="Select points that stand out of the dominant plane, toward the camera, by at least this much, for "
        "the method plane. m, over 0. Keep it above the depth noise and below the object's radius.",
    )
    max_width: float = Field(
        0.05,
        gt=0,
        description="Remove regions wider than this in every direction, such as a gripper or a hand. Masks given by the "
        "caller and the method everything are not affected. m (px in 2-D), over 0. Raise it for objects "
        "thicker than this.",
    )
    max_width_ratio: float = expert(
        2.5,
        "Remove regions wider in every direction than this multiple of the mask's median width. Masks given by the "
        "caller and the method everything are not affected. Ratio, over 1. Raise it for objects of very different "
        "widths.",
        gt=1,
    )
    strand_smoothing_radii: float = expert(
        2.4,
        "Length along a strand over which depth that is torn or comes in waves is smoothed; larger waves over more, by the "
        "square root. Radii, over 0. Raise it if chains of straight cables are wavy with a stereo camera, lower it for tight "
        "bends. Frames of a sequence are smoothed over 0.7 of it, and then over time.",
        gt=0,
        le=100,
    )
    working_width: float | None = expert(
        None,
        "Work on a large photograph reduced by the largest whole factor that leaves its strands this wide, and 640 x 360 pixels "
        "in all. Results are in px of the photograph, and so are lengths that are set; costs per px and `min_component` count px "
        "of the reduced one. Not done with a `reference`. px, over 0; null never reduces. Raise it where thin strands lie beside "
        "wide ones.",
        gt=0,
    )
    min_depth: float = Field(
        0.02,
        gt=0,
        description="Ignore depth readings nearer than this; if the median depth is nearer, the frame is refused, since "
        "its unit must be wrong. m, over 0. Lower it for macro lenses.",
    )
    max_depth: float = Field(
        20.0,
        gt=0,
        description="Ignore depth readings farther than this; if the median depth is farther, the frame is refused, since "
        "its unit must be wrong. m, over 0. Raise it outdoors.",
    )
    outlier_slope: float = expert(
        0.003,
        "Largest depth step between neighboring readings of one surface; readings that differ by more from most of "
        "their neighbors are removed. m per pixel of distance, over 0; the program itself raises it to 3 times the "
        "measured depth noise, and far beyond the median depth in proportion to the distance. Raise it if strands that run "
        "away from the camera lose parts.",
        gt=0,
    )
    min_component: int = expert(
        30,
        "Remove connected pieces of the mask smaller than this, and close holes smaller than this. Pixels, 1 or more. "
        "Lower it for thin wires far away in small images.",
        ge=1,
    )
    equal_widths: bool = expert(
        True,
        "Divide stretches of a mask that are as wide as several strands into strands of equal width where the image shows "
        "no valleys between them. true or false; merge.branches turns it off. Turn it off for objects of several widths.",
    )
    hues: bool = expert(
        True,
        "Tell cables of different colors that run side by side apart: each color is a layer of the mask. true or false. Turn it "
        "off to follow Keipour et al. (RA-L 2022) to the letter.",
    )

    @model_validator(mode="after")
    def _needs(self) -> SegmentConfig:
        if self.method == "hsv" and not self.ranges:
            raise ValueError("segment.method is hsv but segment.ranges is empty: give at least one {low: [h,s,v], high: [h,s,v]}")
        if self.method == "background" and self.reference is None:
            raise ValueError("segment.method is background but segment.reference is not set: give the image without the object")
        if self.method == "onnx" and self.onnx.model is None:
            raise ValueError("segment.method is onnx but segment.onnx.model is not set: give the path of an ONNX file")
        if self.min_depth >= self.max_depth:
            raise ValueError(f"segment.min_depth {self.min_depth} is not below segment.max_depth {self.max_depth}")
        return self
