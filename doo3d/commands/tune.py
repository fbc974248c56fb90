"""Implement `doo3d tune`: propose a configuration for a camera and an object."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from .arguments import CameraOption, FrameOption, InputOption, Overrides, check_new_file, config_of, frame_of, save

if TYPE_CHECKING:
    from ..tools.tuning import Tuned

CHECKSUM = "# Checksum "
"""First words of the first line of a proposed configuration."""

PRESETS = {True: "image", False: "default"}  # by: the format has images only


def tune(
    capture: Annotated[
        Path, typer.Argument(metavar="INPUT", help="A capture with depth, a photograph, a folder of them or a video.")
    ],
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="FILE", help="The configuration to write; its picture is written beside it.")
    ] = Path("tuned.yaml"),
    pick: Annotated[
        list[str] | None, typer.Option("--pick", metavar="X,Y", help="A pixel on the object; repeat for its other colors.")
    ] = None,
    box: Annotated[str | None, typer.Option("--box", metavar="X,Y,W,H", help="Region of the object in the image, px.")] = None,
    frame: FrameOption = None,
    config: Annotated[
        str | None,
        typer.Option("--config", "-c", help="Preset or YAML file to start from. Default: the preset that fits INPUT."),
    ] = None,
    overrides: Overrides = None,
    input_options: InputOption = None,
    camera: CameraOption = None,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
) -> None:
    """Propose color ranges, voxel size and segment length for the object in INPUT.

    Writes these values as a configuration, with a picture of the segmentation beside it, and prints the values with their
    reasons. Without --pick and --box, they are for the strands that detection finds, which are listed; color ranges are proposed
    if detection then finds all of them again. Where it finds none, the longest thin object with a color of its own is taken.

    \b
    Examples:
      doo3d tune sample_clouds/crossing -o tuned.yaml && doo3d detect sample_clouds/crossing -c tuned.yaml
      doo3d tune photo.jpg --pick 412,230 --pick 600,118
    """
    from ..config import load_config, parse_overrides
    from ..inputs import IMAGE_FORMATS, ReadOptions, open_capture

    given = config_of(config, overrides) if config else None
    opened = open_capture(capture, given is not None and given.mode == "2d", None, ReadOptions.from_pairs(input_options, camera))
    used = given or load_config(PRESETS[opened.format in IMAGE_FORMATS], parse_overrides(overrides or []))
    entry = frame_of(opened, frame)
    picture = out.with_suffix(".png")
    if out.suffix not in (".yaml", ".yml"):
        raise InputError(f"-o {out}: a configuration has the suffix .yaml: give another name", code="out-suffix")
    for path in (out, picture):
        check_new_file(path, force or _is_unedited(opened.path, out, picture))
    picks = [(x, y) for x, y in (_numbers("--pick", text, 2) for text in pick or [])]
    region = _numbers("--box", box, 4) if box else None
    if picks and region:
        raise InputError("--pick and --box exclude each other: give one", code="options-conflict")
    from ..config.documentation import annotated_yaml
    from ..tools.tuning import tune as propose
    from ..viz.backdrop import backdrop_of
    from ..viz.encoding import encode_image
    from ..viz.tuning_preview import draw_tuning

    data = entry.load().data
    tuned = propose(data, used, picks, (region[0], region[1], region[2], region[3]) if region else None)
    command = f"doo3d detect {capture} -c {out}"
    drawn = encode_image(draw_tuning(backdrop_of(data).image, tuned.mask, tuned.object_mask))
    head = f"# Proposed by doo3d tune for frame {entry.name} of {opened.path.name}; {picture.name} shows the segmentation.\n"
    text = f"{head}# {command}\n\n{annotated_yaml(tuned.config, tuned.reasons)}"
    checksum = _checksum(opened.path, text, drawn)
    save(out, f"{CHECKSUM}{checksum}: while this file and {picture.name} are unedited, doo3d tune may replace them\n{text}")
    save(picture, drawn)
    typer.echo("\n".join([*summary(tuned), f"{'next':<10} {command}", f"{'':<10} -> {out}, {picture}"]))


def summary(tuned: Tuned) -> list[str]:
    """Return the lines that `doo3d tune` prints.

    They state the object's width, the recall and precision of the segmentation, the proposed values with their reasons, and
    advice.
    """
    config, reasons = tuned.config, tuned.reasons
    width = f"{tuned.width_px:.1f} px wide" + (f", {1000 * tuned.width_m:.1f} mm" if tuned.width_m is not None else "")
    lines = [("strand", sentence) for sentence in tuned.strands] + [("object", width)]
    if tuned.recall is not None and tuned.precision is not None:
        lines.append(("recall", f"{tuned.recall:.0%} of the object is segmented"))
        lines.append(("precision", f"{tuned.precision:.1%} of the segmented pixels are the object"))
    if config.segment.method == "hsv":
        for box in config.segment.ranges:
            (a, b), (c, d), (e, f) = zip(box.low, box.high, strict=True)
            lines.append(("color", f"hue {a} to {b}{' (through red)' if a > b else ''}, saturation {c} to {d}, value {e} to {f}"))
    else:
        lines.append(("method", f"{config.segment.method}: {reasons['segment.method']}"))
    unit = "m" if tuned.width_m is not None else "px"
    lines.append(("segments", f"{config.fit.segment_length:g} {unit}: {reasons['fit.segment_length']}"))
    size = "null" if config.voxelize.size is None else f"{config.voxelize.size:g} m"
    lines.append(("voxels", f"{size}: {reasons['voxelize.size']}"))
    lines += [("try", sentence) for sentence in tuned.advice]
    return [f"{name:<10} {text}" for name, text in lines]


def _checksum(capture: Path, text: str, picture: bytes) -> str:
    """Return the CRC-32 of a proposal: of the capture's path, the text of the configuration, and the picture."""
    content = "\n".join([str(capture.resolve()), text]).encode(errors="surrogateescape")
    return f"{zlib.crc32(content + picture):08x}"


def _is_unedited(capture: Path, out: Path, picture: Path) -> bool:
    """Return whether the files of a proposal were made for the same capture and are unchanged."""
    try:
        first, text = out.read_bytes().decode("utf-8").split("\n", 1)
        return first.startswith(CHECKSUM + _checksum(capture, text, picture.read_bytes()))
    except (OSError, ValueError):
        return False


def _numbers(option: str, text: str, count: int) -> list[int]:
    try:
        values = [int(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != count:
        wanted = "X,Y in pixels, such as 412,230" if count == 2 else "X,Y,W,H in pixels, such as 100,50,640,480"
        raise InputError(f"{option} {text}: expected {wanted}", code="value-invalid")
    return values
