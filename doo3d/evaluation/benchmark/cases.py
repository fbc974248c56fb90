"""Frames with known truth: rendered scenes, and captures on disk with a truth file."""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...inputs.capture import FrameRef
from ...inputs.read_options import DEFAULT, ReadOptions
from ...types import Array, Bools, Camera, Cloud, Detection, Frame, Image
from ..metrics.record import Record
from ..rendering.renderer import Rendered, render
from ..scenes.model import Scene, Truth
from ..scenes.registry import FIRST_COUNTED_SEED, make_scene
from ..truth_arrays import FILE, ragged_mask_of, read_truth_arrays, with_depth, with_seen
from ..truth_file import read_truth

TRUTH = "truth.json"
MIN_PIECE = 0.010
"""Least length in m of a piece of a cable inside the image that counts as an object."""


@dataclass(frozen=True)
class KnownFrame:
    """A frame whose cables are known.

    Attributes
    ----------
    data
        the frame, cloud or image that is given to the detection.
    truths
        the true cables in it.
    mask
        (H, W) bool, the pixels of the cables; None if unknown.
    ragged
        (H, W) bool, an imperfect mask that comes with the frame; None if there is none.
    scene
        the scene that was rendered; None if the frame was not.
    """

    data: Frame | Cloud | Image
    truths: tuple[Truth, ...]
    mask: Bools | None = None
    ragged: Bools | None = None
    scene: Scene | None = None


@dataclass(frozen=True)
class Case:
    """A frame or sequence with known truth, to be scored. It is rendered or read only when `load` is called.

    Attributes
    ----------
    name
        name of the frame or sequence.
    family
        name of the group of cases in whose line of the table it counts.
    load
        function without arguments that returns the frame or sequence with its truth; it must be picklable for measuring in other
        processes.
    truths
        the true cables of a frame on disk, which count as not detected if the frame cannot be read; empty for a rendered frame.
    seed, sensor
        the seed of a rendered scene, and its simulated depth camera; None and "" for a frame read from disk.
    records
        number of records that measuring the case returns.
    """

    name: str
    family: str
    load: Callable[[], Any]
    truths: tuple[Truth, ...] = ()
    seed: int | None = None
    sensor: str = ""
    records: int = 1

    def record(self, values: Mapping[str, Any], detection: Detection | None = None) -> Record:
        """Return the record of the case with its values and its detection."""
        counted = self.seed is not None and self.seed >= FIRST_COUNTED_SEED
        names = {"family": self.family, "frame": self.name, "seed": self.seed, "sensor": self.sensor, "counted": counted}
        result = Record(names | dict(values))
        result.case, result.detection = self, detection
        return result


def scene_cases(
    families: Iterable[str], seeds: Iterable[int], sensor: str = "d435", size: tuple[int, int] = (1280, 720)
) -> list[Case]:
    """Return a case for every family of scenes and every seed, family by family; nothing is rendered yet.

    Parameters
    ----------
    families
        names as `make_scene` takes them; of "tubes:" and the path of a text file of tubes, the file's name becomes the family of
        the case.
    seeds
        integers, 0 or more; one scene of each family is made for each seed.
    sensor
        simulated depth camera: "d435", "d455", "zivid", "stereo", or "none" for exact depth.
    size
        (width, height) px of the image.
    """
    seeds = list(seeds)
    return [
        Case(f"{name}_{seed:03d}", name, partial(_render_scene, family, seed, sensor, size), (), seed, sensor)
        for family, name in ((family, family.rpartition("/")[2]) for family in families)
        for seed in seeds
    ]


def _render_scene(family: str, seed: int, sensor: str, size: tuple[int, int]) -> KnownFrame:
    scene = make_scene(family, seed, size)
    return known_frame(render(scene, sensor), scene)


def known_frame(rendered: Rendered, scene: Scene | None = None) -> KnownFrame:
    """Return a rendered scene as a frame with known truth: its image data, its true cables and its true mask.

    A cable that leaves the image and returns becomes one cable for each piece inside the image, since the image does not show
    that the pieces belong together. `scene` is the scene that was rendered.
    """
    camera = rendered.frame.camera
    pieces = [piece for truth in rendered.truths for piece in pieces_in_view(truth, camera)]
    return KnownFrame(rendered.frame, tuple(pieces), rendered.mask, scene=scene)


def pieces_in_view(truth: Truth, camera: Camera) -> list[Truth]:
    """Return the pieces of a cable inside the image that are at least 10 mm long; the cable itself if all of it is inside.

    Parameters
    ----------
    truth
        the cable, in the camera's optical frame.
    camera
        the intrinsics and the image size.
    """
    pixels = camera.project(truth.axis)
    size = np.array([camera.width, camera.height])
    inside = np.asarray(((pixels >= -0.5) & (pixels < size - 0.5)).all(axis=1))
    if inside.all():
        return [truth]
    start = int(np.argmin(inside)) if truth.closed else 0
    order = (np.arange(len(inside)) + start) % len(inside)
    edges = np.flatnonzero(np.diff(np.pad(inside[order].astype(int), 1))).reshape(-1, 2)
    seen = truth.seen
    return [
        replace(truth, axis=truth.axis[order[a:b]], closed=False, seen=None if seen is None else seen[order[a:b]])
        for a, b in edges
        if (b - a) * truth.spacing >= MIN_PIECE
    ]


def capture_cases(
    capture: str | Path,
    truth: str | Path | None = None,
    family: str | None = None,
    masks: str | Path | None = None,
    options: ReadOptions = DEFAULT,
    depth: str | None = None,
) -> list[Case]:
    """Return a case for each frame of a capture that the truth file names, in the capture's order.

    Parameters
    ----------
    capture
        path of a capture or cloud of any format that is read in 3-D.
    truth
        the truth file (schema doo3d/truth/1), or arrays as `read_truth_arrays` reads them; None for truth.json or truth.npz in
        the capture's folder, or <name>.truth.json beside a cloud.
    family
        name of the group that the cases are counted in; None for the name of `capture`'s file or folder.
    masks
        an image, or a folder of images, used instead of the capture's own masks.
    options
        values that the capture lacks, such as its intrinsics.
    depth
        path, within the folder of a capture with truth.npz, of a depth image to use instead of the capture's own; None for its
        own.

    Raises
    ------
    InputError : the capture or the truth cannot be read at all, or the truth names a frame that the capture does not have.
    """
    from ...inputs import open_capture

    capture = Path(capture)
    refs = {ref.name: ref for ref in open_capture(capture, masks=masks, options=options).frames}
    path = Path(truth) if truth is not None else _truth_path(capture)
    if path.suffix == ".npz":
        return _array_cases(capture, path, family or capture.name, refs, depth)
    frames = read_truth(path)
    if unknown := [name for name in frames if name not in refs]:
        raise InputError(f"{path}: names the frame {unknown[0]}, which {capture} does not have", code="frame-unknown")

    found = [(name, ref, frames[name]) for name, ref in refs.items() if name in frames]
    return [Case(name, family or capture.name, partial(_read, ref, truths), truths) for name, ref, truths in found]


def _read(ref: FrameRef, truths: tuple[Truth, ...]) -> KnownFrame:
    frame = ref.load()
    return KnownFrame(frame.data, truths, frame.mask)


def _array_cases(capture: Path, truth: Path, family: str, refs: Mapping[str, FrameRef], depth: str | None) -> list[Case]:
    """Return a case for each frame of a capture with truth.npz; a number at the end of the family's name is removed."""
    arrays, family, single = read_truth_arrays(truth, list(refs)), re.sub(r"_\d+$", "", family), len(refs) == 1
    names = [capture.name if single else f"{capture.name}/{name}" for name in refs]
    frames = zip(names, refs.values(), arrays.frames.values(), strict=True)
    return [
        Case(name, family, partial(_read_with_arrays, ref, known, arrays.labels, capture, depth), known)
        for name, ref, known in frames
    ]


def _read_with_arrays(
    ref: FrameRef, truths: tuple[Truth, ...], labels: Array | None, folder: Path, depth: str | None
) -> KnownFrame:
    """Read a frame, with the visible parts of its cables, and an imperfect mask and another depth image if `folder` has them."""
    loaded = ref.load()
    data, mask = loaded.data, loaded.mask
    if not isinstance(data, Frame):
        raise InputError(f"{folder}: has no depth, which {FILE} is about", code="depth-missing")
    if depth is not None:
        data = with_depth(data, folder, depth)
    seen = with_seen(truths, data.camera, labels, mask)
    pieces = tuple(piece for cable in seen for piece in pieces_in_view(cable, data.camera))
    return KnownFrame(data, pieces, mask, ragged_mask_of(folder, data.depth.shape))


def folder_cases(folder: str | Path, depth: str | None = None) -> list[Case]:
    """Return a case for each frame with known truth, of all captures and clouds at any depth below a folder.

    A capture has known truth if its folder holds truth.json or truth.npz; a cloud, if <name>.truth.json is in the same folder.
    The family of a case is the path of its capture or cloud, relative to the folder; with truth.npz, a number at its end is
    removed. `depth` is as for `capture_cases`; captures with truth.npz that lack this depth image are skipped.

    Raises
    ------
    InputError : there is no truth file below the folder, or a capture, cloud or truth file cannot be read.
    """
    folder, cases = Path(folder), list[Case]()
    arrays = [path for path in folder.rglob(FILE) if depth is None or (path.parent / depth).exists()]
    for path in sorted([*folder.rglob(f"*{TRUTH}"), *arrays]):
        data = path.parent if path.name in (TRUTH, FILE) else _cloud_path(path)
        family = data.relative_to(folder).as_posix() if data != folder else folder.name
        cases += capture_cases(data, path, family, depth=depth)
    if not cases:
        raise InputError(f"{folder}: nothing below it has a {TRUTH}, {FILE} or <name>.{TRUTH} beside it", code="truth-missing")
    return cases


def _truth_path(capture: Path) -> Path:
    if capture.is_dir():
        return capture / (TRUTH if (capture / TRUTH).exists() or not (capture / FILE).exists() else FILE)
    return capture.with_suffix(f".{TRUTH}")


def _cloud_path(truth: Path) -> Path:
    """Return the path of the cloud that a truth file belongs to."""
    stem = truth.name.removesuffix(f".{TRUTH}")
    paths = [file for file in sorted(truth.parent.glob(f"{stem}.*")) if not file.name.endswith(".json")]
    if not paths:
        raise InputError(f"{truth}: there is no cloud {stem}.* beside it", code="cloud-missing")
    return paths[0]
