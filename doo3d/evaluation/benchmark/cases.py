"""What is scored: frames of known truth, from scenes that are rendered or captures that lie on the disk."""

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
class Known:
    """A frame or cloud, what it shows, and the cables' pixels (H, W) bool; None where they are not known."""

    data: Frame | Cloud | Image
    truths: tuple[Truth, ...]
    mask: Bools | None = None


@dataclass(frozen=True)
class Case:
    """One frame to be scored, cheap to hold; `load` renders or reads it. family : what it is counted with.

    truths : of a frame on the disk, for when it cannot be read.
    """

    name: str
    family: str
    load: Callable[[], Known]
    truths: tuple[Truth, ...] = ()


def scene_cases(
    families: Iterable[str], seeds: Iterable[int], sensor: str = "d435", size: tuple[int, int] = (1280, 720)
) -> list[Case]:
    """Every family and seed. Of a family that is read from a file, the file's name is the family."""
    seeds = list(seeds)
    return [
        Case(f"{family.rpartition('/')[2]}_{seed:03d}", family.rpartition("/")[2], partial(_scene, family, seed, sensor, size))
        for family in families
        for seed in seeds
    ]


def _scene(family: str, seed: int, sensor: str, size: tuple[int, int]) -> Known:
    return known(render(make_scene(family, seed, size), sensor))


def known(rendered: Rendered) -> Known:
    """A rendered scene with its true mask."""
    return Known(rendered.frame, rendered.truths, rendered.mask)


def capture_cases(
    capture: str | Path,
    truth: str | Path | None = None,
    family: str | None = None,
    masks: str | Path | None = None,
    options: ReadOptions = DEFAULT,
) -> list[Case]:
    """The frames of a capture that its truth knows; the others are left out.

    Parameters
    ----------
    capture : in any of the formats that are read in 3-D. truth : a file as `write_truth` writes it; None: truth.json in the
    capture's folder, or <name>.truth.json beside a cloud. family : None: the capture's name. masks : instead of
    the capture's own, an image or a folder of them. options : what the capture does not say itself.

    Raises
    ------
    InputError : capture or truth cannot be read at all, or the truth knows a frame that the capture does not have.
    """
    from ...inputs import open_capture

    capture = Path(capture)
    entries = {entry.name: entry for entry in open_capture(capture, masks=masks, options=options).frames}
    path = Path(truth) if truth is not None else _truth_of(capture)
    frames = read_truth(path)
    if unknown := [name for name in frames if name not in entries]:
        raise InputError(f"{path}: knows the frame {unknown[0]}, which {capture} does not have", code="frame-unknown")

    def load(name: str) -> Known:
        shot = entries[name].load()
        return Known(shot.data, frames[name], shot.mask)

    return [Case(name, family or capture.name, partial(load, name), frames[name]) for name in entries if name in frames]


def folder_cases(folder: str | Path) -> list[Case]:
    """All captures and clouds below `folder` that have their truth beside them.

    Raises
    ------
    InputError : there are none.
    """
    folder, cases = Path(folder), list[Case]()
    for path in sorted(folder.rglob(f"*{TRUTH}")):
        data = path.parent if path.name == TRUTH else _cloud_beside(path)
        cases += capture_cases(data, path, data.relative_to(folder).as_posix() if data != folder else folder.name)
    if not cases:
        raise InputError(f"{folder}: nothing below it has a {TRUTH} or <name>.{TRUTH} beside it", code="truth-missing")
    return cases


def _truth_of(capture: Path) -> Path:
    return capture / TRUTH if capture.is_dir() else capture.with_suffix(f".{TRUTH}")


def _cloud_beside(path: Path) -> Path:
    stem = path.name.removesuffix(f".{TRUTH}")
    found = [file for file in sorted(path.parent.glob(f"{stem}.*")) if not file.name.endswith(".json")]
    if not found:
        raise InputError(f"{path}: there is no cloud {stem}.* beside it", code="cloud-missing")
    return found[0]
