"""Frames of many sources on which the confidence is fitted and measured, each with what makes a chain of it right.

A source is one data set, or one kind of rendered scenes, with one way of giving the object. The folders are those of the public
data sets: photos, cset, mbest, bundles, zed_pairs, hard_scenes and device_files; a folder that is absent is left out.

A chain is right in a frame with depth if it follows one cable from end to end without a wrong connection, by the strict rule
where the object is given, and in the image where nothing is. In a photograph with labels it is if its drawn DICE with a cable is
above 0.8; in a bundle, whose labels give each cable the width of the bundle, if it runs along one cable from end to end; in a
photograph with one mask of all cables, if nine tenths of its joints lie on it.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from doo3d import Chain, Image, open_capture
from doo3d.evaluation.benchmark.cases import Case, KnownFrame, capture_cases, pieces_in_view, scene_cases
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.photos.datasets import Photo, cset, mbest
from doo3d.evaluation.photos.free_crops import free_rectangle
from doo3d.evaluation.photos.score import drawn_pixels
from doo3d.evaluation.rendering.ragged_mask import ragged_mask
from doo3d.evaluation.scenes.model import Truth
from doo3d.evaluation.scenes.registry import GROUPS, family_rng
from doo3d.inputs.capture import FrameRef
from doo3d.inputs.read_options import ReadOptions
from doo3d.types import Array, Bools, Cloud, Frame, Ints

MIN_DICE, MIN_ON_MASK, MARGIN_PX = 0.8, 0.9, 2
"""Least DICE of a drawn chain with a cable, least share of the joints on a mask, and px by which the mask is widened."""

MIN_ALONG, MIN_TRACED, SAMPLE_PX, ALONG_MARGIN_PX = 0.95, 0.93, 2.0, 3
"""Least share of a chain on a label widened by a margin, and of the label within the bundle's width of the chain."""

WINDOWS, WINDOW_SIZE, WINDOW_MARGIN_PX = 3, (240, 160), 10
"""Parts of a photograph without a labelled pixel at most, their least width and height, and their distance from labels, px."""

MOVING_EVERY = 7
"""Frames of a moving capture of which one is taken."""

OFFICE_CABLES_PX, OFFICE_SCALE = 110, 1000
"""px from the left border of the office's frames, where cables lie on a desk and are cut off; and its units per metre."""

LABELLED = {"cset": cset, "mbest": mbest}
"""Data sets of photographs with a label for each cable -> their readers."""

UNLABELLED = ("img_00 left", "img_02 left", "img_08 left")
"""Views of zed_pairs that show cables on the floor, which no mask names."""

RENDERED = {"d435": 300, "stereo": 301, "zivid": 302}
"""Simulated cameras, and the seed of the rendered scenes of each."""

Judge = Callable[[Sequence[Chain]], list[bool]]


@dataclass(frozen=True)
class Known:
    """A frame of a source.

    data : the frame itself. mask : given, or None. judge : says which chains are right. cables : their number. is_counted :
    whether that number is given, too.
    """

    data: Frame | Image | Cloud
    mask: Bools | None
    judge: Judge
    cables: int
    is_counted: bool = False


@dataclass(frozen=True)
class Source:
    """Frames of one kind: name, the group that is left out together, whether the object is given, and how to get the frames."""

    name: str
    group: str
    is_given: bool
    frames: list[tuple[str, Callable[[], Known | None]]]


def sources(data: Path, cache: Path) -> Iterator[Source]:
    """Yield all sources: DATA is the folder of the data sets, CACHE keeps rendered frames."""
    yield from photograph_sources(data)
    yield from window_sources(data)
    if (data / "hard_scenes").is_dir():
        yield from hard_sources(data / "hard_scenes")
    office = data / "device_files" / "tum_unsorted"
    if office.is_dir():
        refs = open_capture(office, options=ReadOptions(depth_scale=OFFICE_SCALE)).frames
        yield Source("office", "office", False, [(ref.name, partial(_office, ref, False)) for ref in refs])
        yield Source("office, color alone", "office", False, [(ref.name, partial(_office, ref, True)) for ref in refs])
    yield from rendered_sources(cache)


def photographs(data: Path, name: str, masks: str = "labels") -> list[tuple[str, Callable[[], Photo]]]:
    """Return name and reader of each photograph of a data set; none if it is not there.

    The labels of photos, bundles and zed_pairs are 1 on their cables together. `masks` is as for the readers of cset and mbest.
    """
    folder = data / name
    if name in LABELLED:
        cases = LABELLED[name](folder, masks) if folder.is_dir() else []
        return [(f"{case.family} {case.name}", case.load) for case in cases]
    if name == "zed_pairs":
        files = sorted(folder.glob("img_??.png"))
        return [(f"{file.stem} {side}", partial(_view, file, side)) for file in files for side in ("left", "right")]
    files = sorted((folder / ("imgs" if name == "bundles" else "images")).glob("*"))
    return [(file.stem, partial(_masked, file, 128 if name == "bundles" else 1)) for file in files]


def _masked(file: Path, least: int) -> Photo:
    mask = _read_mask(next((file.parents[1] / "masks").glob(f"{file.stem}.*")), least)
    return Photo("", file.stem, _read(file), mask.astype(np.uint8), mask)


def _view(file: Path, side: str) -> Photo:
    color, mask = _read(file), _read_mask(file.with_name(f"{file.stem}_{side}_mask_0.png"))
    half = color.shape[1] // 2
    return Photo("", file.stem, color[:, :half] if side == "left" else color[:, half:], mask.astype(np.uint8), mask)


def photograph_sources(data: Path) -> Iterator[Source]:
    """Yield real photographs, with nothing given and with a mask given."""
    ways = {
        "cset": ((None, "labels"), ("mask (network)", "network"), ("mask (labels)", "labels")),
        "mbest": ((None, "labels"), ("mask (hsv)", "hsv"), ("mask (labels)", "labels")),
        "photos": ((None, ""), ("mask", "")),
        "bundles": ((None, ""), ("mask", "")),
        "zed_pairs": ((None, ""),),
    }
    for name, given in ways.items():
        for mask, masks in given:
            folder = data / name / "labels" if name == "bundles" else None
            frames = [
                (stem, partial(_known, read, mask is not None, name, folder)) for stem, read in photographs(data, name, masks)
            ]
            if frames:
                yield Source(f"{name}, {mask or 'nothing'}", name, mask is not None, frames)


def _known(read: Callable[[], Photo], is_given: bool, name: str, labels: Path | None) -> Known:
    """Return a photograph of a data set with its judge; `labels` is the folder of the label of each cable of bundles."""
    photo = read()
    judge: Judge = partial(matches_label, photo.labels) if name in LABELLED else partial(on_mask, photo.mask)
    cables = photo.cables
    if labels is not None:
        each = [_read_mask(label) for label in sorted(labels.glob(f"{photo.name}_*.png"))]
        judge, cables = partial(along_a_label, each), len(each)
    return Known(Image(photo.image), photo.mask if is_given else None, judge, cables)


def window_sources(data: Path) -> Iterator[Source]:
    """Yield parts of the photographs without a labelled pixel."""
    for name in ("cset", "mbest", "photos", "zed_pairs"):
        chosen = [(stem, read) for stem, read in photographs(data, name) if stem not in UNLABELLED and " right" not in stem]
        frames = [(f"{stem} {k}", partial(_window, read, k)) for stem, read in chosen for k in range(WINDOWS)]
        yield Source(f"{name}, parts without a cable", "parts", False, frames)


def _window(read: Callable[[], Photo], number: int) -> Known | None:
    """Return the part of a photograph of this number, the largest first; None if there are fewer."""
    photo = read()
    taken = photo.labels > 0
    for _ in range(number + 1):
        part = free_rectangle(taken, WINDOW_SIZE, WINDOW_MARGIN_PX)
        if part is None:
            return None
        taken[part] = True
    return Known(Image(np.ascontiguousarray(photo.image[part])), None, nothing_is_right, 0)


def hard_sources(folder: Path) -> Iterator[Source]:
    """Yield rendered scenes of another hand, and moving cables, each by a stereo camera and with simple noise."""
    captures = sorted(path for path in folder.glob("*_*") if path.is_dir())
    for name, depth in (("stereo", None), ("simple noise", "other/depth_simple.png")):
        cases = [case for path in captures for case in capture_cases(path, path / "truth.npz", depth=depth)]
        for given in (None, "mask, number", "ragged"):
            frames = [(case.name, partial(_scene, case.load, given)) for case in cases]
            yield Source(f"hard scenes, {name}, {given or 'nothing'}", "hard scenes", given is not None, frames)
    for name, pattern in (("stereo", "cable_*"), ("simple noise", "simple_*")):
        moving = [frame for path in sorted((folder / "moving").glob(pattern)) for frame in moving_frames(path)]
        yield Source(f"moving cables, {name}, nothing", "moving", False, moving)


def moving_frames(folder: Path) -> Iterator[tuple[str, Callable[[], Known]]]:
    """Yield some frames of a moving capture with truth.npz, but for those without any depth."""
    truth = np.load(folder / "truth.npz")
    refs = open_capture(folder).frames
    for k in sorted(set(range(0, len(refs), MOVING_EVERY)) - set(truth["no_depth"].tolist())):
        yield f"{folder.name} {k}", partial(_moving, refs[k], truth["curves"][k], float(truth["radius"]))


def _moving(ref: FrameRef, axis: Array, radius: float) -> Known:
    frame = ref.load().data
    truths = tuple(pieces_in_view(Truth(np.asarray(axis, dtype=float), radius), frame.camera))
    return Known(frame, None, partial(follows_cable, frame, truths, False), len(truths))


def _scene(load: Callable[[], KnownFrame], given: str | None, name: str = "") -> Known:
    """Return a scene with nothing, with its ragged mask, or with its true mask and the number of cables given."""
    known = load()
    mask, cables = None if given is None else known.mask, len(known.truths)
    if given == "ragged" and mask is not None:
        mask = ragged_mask(mask, family_rng(f"{name}/ragged", 0)) if known.ragged is None else known.ragged
    return Known(
        known.data, mask, partial(follows_cable, known.data, known.truths, given is not None), cables, given == "mask, number"
    )


def _office(ref: FrameRef, color_alone: bool) -> Known:
    """Return a frame of the office without its left part, where cables lie."""
    frame, cut = ref.load().data, OFFICE_CABLES_PX
    color = np.ascontiguousarray(frame.color[:, cut:])
    if color_alone:
        return Known(Image(color), None, nothing_is_right, 0)
    camera = replace(frame.camera, cx=frame.camera.cx - cut, width=frame.camera.width - cut)
    return Known(replace(frame, color=color, depth=frame.depth[:, cut:].copy(), camera=camera), None, nothing_is_right, 0)


def rendered_sources(cache: Path) -> Iterator[Source]:
    """Yield rendered scenes of the project's own families, with and without a cable."""
    for sensor, seed in RENDERED.items():
        for name, group, seeds in (
            ("scenes", "all", (seed,)),
            ("tough scenes", "tough", (seed,)),
            ("no cable", "without", (seed, seed + 10)),
        ):
            cases = scene_cases(GROUPS[group], seeds, sensor)
            for given in (None, "ragged", "mask, number") if group != "without" else (None,):
                frames = [(case.name, partial(_scene, partial(rendered, case, cache), given, case.name)) for case in cases]
                yield Source(
                    f"{name}, {sensor}, {given or 'nothing'}",
                    "without" if group == "without" else "renders",
                    given is not None,
                    frames,
                )
            if sensor == "d435" and group != "tough":
                frames = [(case.name, partial(_rendered_color, case, cache)) for case in cases]
                yield Source(f"{name}, color alone", "without" if group == "without" else "renders", False, frames)


def rendered(case: Case, cache: Path | None) -> KnownFrame:
    """Return a frame from the cache, or render it and keep it there."""
    if cache is None:
        return case.load()
    file = cache / f"{case.sensor}_{case.name}.pkl"
    if file.exists():
        return pickle.loads(file.read_bytes())
    known = case.load()
    cache.mkdir(parents=True, exist_ok=True)
    file.write_bytes(pickle.dumps(known))
    return known


def _rendered_color(case: Case, cache: Path) -> Known:
    known = rendered(case, cache)
    mask = np.zeros(known.data.depth.shape, dtype=bool) if known.mask is None else known.mask
    return Known(Image(known.data.color), None, partial(on_mask, mask), int(mask.any()))


def follows_cable(frame: Frame, truths: Sequence[Truth], is_strict: bool, chains: Sequence[Chain]) -> list[bool]:
    """Tell which chains follow one cable from end to end, by the strict rule or in the image."""
    rule = "correct" if is_strict else "image_correct"
    return [any(score((chain,), (truth,), None, frame.camera)[rule] for truth in truths) for chain in chains]


def matches_label(labels: Ints, chains: Sequence[Chain]) -> list[bool]:
    """Tell which chains, drawn with their own width, have enough DICE with one label of (H, W)."""
    sizes = np.bincount(labels.ravel(), minlength=int(labels.max()) + 1)
    right = []
    for chain in chains:
        pixels = drawn_pixels(chain, labels.shape)
        common = np.bincount(labels[pixels], minlength=len(sizes))
        right.append(bool((2 * common[1:] > MIN_DICE * (sizes[1:] + np.count_nonzero(pixels))).any()))
    return right


def on_mask(mask: Bools, chains: Sequence[Chain]) -> list[bool]:
    """Tell which chains lie on a mask of all cables."""
    near = _widened(mask, MARGIN_PX)
    joints = [np.rint(chain.joints.clip(0, np.array(mask.shape[::-1]) - 1)).astype(int) for chain in chains]
    return [bool(near[v, u].mean() >= MIN_ON_MASK) for u, v in (each.T for each in joints)]


def along_a_label(labels: Sequence[Bools], chains: Sequence[Chain]) -> list[bool]:
    """Tell which chains run along one of the labels from end to end."""
    return [any(runs_along(chain, label) for label in labels) for chain in chains]


def runs_along(chain: Chain, label: Bools) -> bool:
    """Tell whether a chain runs along a label from end to end."""
    samples = chain.nodes(max(2, round(chain.length / SAMPLE_PX)))
    width = 2 * float(cv2.distanceTransform(label.astype(np.uint8), cv2.DIST_L2, 5).max()) + 2
    u, v = np.rint(samples.clip(0, np.array(label.shape[::-1]) - 1)).astype(int).T
    distance = cKDTree(samples).query(np.argwhere(label)[::7, ::-1])[0]
    return bool(_widened(label, ALONG_MARGIN_PX)[v, u].mean() >= MIN_ALONG and (distance <= width).mean() >= MIN_TRACED)


def nothing_is_right(chains: Sequence[Chain]) -> list[bool]:
    """Tell of a frame without a cable that no chain is right."""
    return [False] * len(chains)


def _widened(mask: Bools, margin: int) -> Bools:
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * margin + 1, 2 * margin + 1), np.uint8)) > 0


def _read(path: Path) -> Array:
    return np.ascontiguousarray(cv2.imread(str(path))[:, :, ::-1])


def _read_mask(path: Path, least: int = 1) -> Bools:
    return cv2.imread(str(path)).max(axis=2) >= least
