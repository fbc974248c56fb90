"""Frames with known truth: rendered scenes, and captures on disk with a truth file."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ...errors import InputError
from ...inputs.read_options import DEFAULT, ReadOptions
from ...types import Bools, Cloud, Frame, Image
from ..rendering.renderer import Rendered, render
from ..scenes.model import Truth
from ..scenes.registry import make_scene
from ..truth_file import read_truth

TRUTH = "truth.json"


@dataclass(frozen=True)
class KnownFrame:
    """A frame or cloud with the cables in it, and the mask of the cables (H, W) bool; None where it is unknown."""

    data: Frame | Cloud | Image
    truths: tuple[Truth, ...]
    mask: Bools | None = None


@dataclass(frozen=True)
class Case:
    """One frame to be scored, cheap to hold; `load` renders or reads it.

    family : the group that it is counted in. truths : of a frame on disk, for when it cannot be read.
    """

    name: str
    family: str
    load: Callable[[], KnownFrame]
    truths: tuple[Truth, ...] = ()


def scene_cases(
    families: Iterable[str], seeds: Iterable[int], sensor: str = "d435", size: tuple[int, int] = (1280, 720)
) -> list[Case]:
    """Return a case for every family and seed; if a family is read from a file, the file's name is the family.

    Parameters
    ----------
    families, seeds
        as of `make_scene`.
    sensor
        a key of SENSORS.
    size
        (width, height) px of the image.
    """
    seeds = list(seeds)
    return [
        Case(f"{name}_{seed:03d}", name, partial(_render_scene, family, seed, sensor, size))
        for family, name in ((family, family.rpartition("/")[2]) for family in families)
        for seed in seeds
    ]


def _render_scene(family: str, seed: int, sensor: str, size: tuple[int, int]) -> KnownFrame:
    return known_frame(render(make_scene(family, seed, size), sensor))


def known_frame(rendered: Rendered) -> KnownFrame:
    """Return a rendered scene with its truth and its true mask."""
    return KnownFrame(rendered.frame, rendered.truths, rendered.mask)


def capture_cases(
    capture: str | Path,
    truth: str | Path | None = None,
    family: str | None = None,
    masks: str | Path | None = None,
    options: ReadOptions = DEFAULT,
) -> list[Case]:
    """Return the frames of a capture that its truth file names; other frames are left out.

    Parameters
    ----------
    capture
        in any of the formats that are read in 3-D.
    truth
        a file as written by `write_truth`; None for truth.json in the capture's folder, or <name>.truth.json beside a
        cloud.
    family
        None for the capture's name.
    masks
        an image or a folder of them, instead of the capture's own masks.
    options
        what the capture does not say itself.

    Raises
    ------
    InputError : capture or truth cannot be read at all, or the truth names a frame that the capture does not have.
    """
    from ...inputs import open_capture

    capture = Path(capture)
    refs = {ref.name: ref for ref in open_capture(capture, masks=masks, options=options).frames}
    path = Path(truth) if truth is not None else _truth_path(capture)
    frames = read_truth(path)
    if unknown := [name for name in frames if name not in refs]:
        raise InputError(f"{path}: names the frame {unknown[0]}, which {capture} does not have", code="frame-unknown")

    def load(name: str) -> KnownFrame:
        frame = refs[name].load()
        return KnownFrame(frame.data, frames[name], frame.mask)

    return [Case(name, family or capture.name, partial(load, name), frames[name]) for name in refs if name in frames]


def folder_cases(folder: str | Path) -> list[Case]:
    """Return the frames of all captures and clouds below a folder that have a truth file beside them.

    Raises
    ------
    InputError : there are none.
    """
    folder, cases = Path(folder), list[Case]()
    for path in sorted(folder.rglob(f"*{TRUTH}")):
        data = path.parent if path.name == TRUTH else _cloud_path(path)
        cases += capture_cases(data, path, data.relative_to(folder).as_posix() if data != folder else folder.name)
    if not cases:
        raise InputError(f"{folder}: nothing below it has a {TRUTH} or <name>.{TRUTH} beside it", code="truth-missing")
    return cases


def _truth_path(capture: Path) -> Path:
    return capture / TRUTH if capture.is_dir() else capture.with_suffix(f".{TRUTH}")


def _cloud_path(truth: Path) -> Path:
    """Return the cloud that a truth file lies beside."""
    stem = truth.name.removesuffix(f".{TRUTH}")
    paths = [file for file in sorted(truth.parent.glob(f"{stem}.*")) if not file.name.endswith(".json")]
    if not paths:
        raise InputError(f"{truth}: there is no cloud {stem}.* beside it", code="cloud-missing")
    return paths[0]
