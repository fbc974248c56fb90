"""One frame: the walk through the stages, one line each, timed."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, field, replace
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from .chains.fill import fill
from .chains.fit import fit
from .chains.prune import Pruned, prune
from .chains.refine import decide_viewpoint, estimate_centerline, extend_ends, lay_chains
from .config import Config, ConfigLike, as_config
from .errors import ArgumentError, InputError
from .geometry.curves import Curves
from .geometry.limits import MAX_SAMPLES
from .geometry.radii import STEP_RADII
from .judge import USUAL, Evidence, Interpretation, most_probable, most_probable_chains, other_interpretations, with_confidence
from .judge.crossings import find_crossings
from .links import Merged, merge
from .links.branches import Branched, find_branches, may_branch
from .scene.scene import Scene
from .segment import Segmentation, segment, segment_extended
from .segment.extend_mask import extend_mask
from .segment.working_picture import enlarged, segment_config, segment_picture
from .skeleton.thin import thin
from .skeleton.traverse import Traversal, traverse
from .skeleton.voxelize import voxelize
from .types import Array, Chain, Cloud, Crossing, Detection, Floats, Frame, Image, Path, Skeleton, VoxelGrid, as_pose
from .types.arguments import array
from .types.arrays import fit_mask
from .types.display import DOUBTFUL_CONFIDENCE
from .types.plausibility import frame_notes
from .types.results import kept_crossings

MASK_EXTENSIONS = 3
"""Times at most that the mask is extended and the chains are found anew."""

MAX_EXTENDED_CHAINS = 30
"""Chains at most along which the mask is extended: following each, and all stages again, take a second or more beyond that."""

EXTENSION_NOTE = "extend_mask: {} chains were found, so the mask is not extended along them; that is done for at most {}"

MAX_UNCERTAIN_PIECES = 100
"""Pieces at most of an uncertain frame that is interpreted in other ways too, for time: an object has 50 at most."""

INTERPRETATION_NOTE = "merge: the object falls into {} pieces, so it is interpreted in one way only; others are tried up to {}"


@dataclass
class Stages:
    """What every stage made of one frame, and the seconds it took.

    Attributes
    ----------
    segmentation
        the foreground (the object's pixels or points), and how many pixels or points were dropped and why.
    scene
        what was captured, as the later stages ask it.
    grid
        the voxels of the seen surface.
    skeleton
        the voxels that thinning left.
    traversal
        the polylines along the skeleton, and how much of the skeleton's length is in none of them.
    fitted
        chains of equal segments along these polylines.
    pruned
        the chains without overlapping segments, and the segments removed.
    merged
        which chains were joined to one object, each connection with its cost, and the chains dropped.
    filled
        one polyline per object, its gaps filled.
    chains
        the result: chains along the object's axis, longest first.
    crossings
        where strands cross in the view, and which is on top.
    seconds
        name of the stage -> s.
    limit_notes
        messages to the user: that the mask was not extended, or the frame interpreted in one way only, since there were too many
        chains or pieces.
    evidence
        for each chain, what speaks against it; its confidence comes from that.
    branched
        junctions and trees of chains; None without `merge.branches`.
    unchosen
        chains that were found besides the wanted number (`merge.chains`) of most probable ones.
    scale
        pixels of the photograph along the side of a pixel in which all of this is given: over 1 if it is so large that a smaller
        copy was worked on (`segment.working_width`).
    """

    segmentation: Segmentation
    scene: Scene
    grid: VoxelGrid
    skeleton: Skeleton
    traversal: Traversal
    fitted: Curves
    pruned: Pruned
    merged: Merged
    filled: list[Path]
    chains: list[Chain]
    crossings: tuple[Crossing, ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    limit_notes: tuple[str, ...] = ()
    evidence: list[Evidence] = field(default_factory=list)
    branched: Branched = field(default_factory=lambda: Branched([]))
    unchosen: tuple[Chain, ...] = ()
    scale: int = 1

    @property
    def paths(self) -> list[Path]:
        """The polylines (`types.Path`) that traversal found along the skeleton, one per branch or loop, in m (px in 2-D)."""
        return self.traversal.paths


class LoadedFrame(Protocol):
    """The data of one frame of a capture, such as `doo3d.inputs.FrameData`."""

    @property
    def data(self) -> Frame | Cloud | Image: ...

    @property
    def base_pose(self) -> Floats | None: ...

    @property
    def notes(self) -> tuple[str, ...]: ...

    def mask_for(self, config: Config) -> Array | None: ...


@runtime_checkable
class FrameReference(Protocol):
    """A frame of a capture that is read when `load` is called, such as `capture[0]`."""

    @property
    def name(self) -> str: ...

    @property
    def source(self) -> os.PathLike[str]: ...

    def load(self) -> LoadedFrame: ...


class _Clock:
    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.last = time.perf_counter()

    def __call__(self, stage: str) -> None:
        """Add the time since the last call to a stage."""
        now = time.perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self.last
        self.last = now


def run_stages(data: Frame | Cloud | Image, config: Config, mask: Array | None = None) -> Stages:
    """Run the whole method on one frame and return what every stage made.

    Parameters
    ----------
    data
        a Frame or Cloud; an Image if the mode of the config is 2d.
    config
        the settings of all stages.
    mask
        the caller's own segmentation, True on the object: (H, W) bool for a Frame or an Image, (N,) bool for the N points of a
        Cloud (`data.points`, without dropped rows). None segments as the config says.

    Returns
    -------
    The product of every stage. If `extend_mask` extended the mask, the later stages ran again, and their last products are
    returned.

    Raises
    ------
    InputError : the data cannot be used; the message says what is wrong, where, and what to do.
    """
    clock = _Clock()
    segmentation, data, config, scale = _segment(data, config, mask)
    clock("segment")
    stages = run_from_segmentation(segmentation, config, clock)
    for _ in range(MASK_EXTENSIONS):
        if len(stages.chains) > MAX_EXTENDED_CHAINS:
            if config.extend_mask.max_length:
                stages.limit_notes += (EXTENSION_NOTE.format(len(stages.chains), MAX_EXTENDED_CHAINS),)
            break
        extended = extend_mask(stages.chains, stages.scene)
        clock("extend_mask")
        if extended is None:
            break
        segmentation = segment_extended(data, segment_config(config), extended, segmentation)
        clock("segment")
        stages = run_from_segmentation(segmentation, config, clock)
    return replace(stages, scale=scale)


def run_from_segmentation(segmentation: Segmentation, config: Config, clock: _Clock) -> Stages:
    """Run the stages from voxelization to crossings and return what every stage made.

    An uncertain frame is interpreted in other ways too, and the most probable interpretation is returned. Where a wanted number
    of chains was refused since the camera sees no object between their ends, none is looked for that joins them nevertheless.

    Parameters
    ----------
    segmentation
        the foreground to start from.
    config
        the settings of all stages.
    clock
        stopwatch of the frame; the seconds of each stage are added to those it already holds.

    Returns
    -------
    The product of every stage, including the given segmentation.
    """
    usual = _interpret(segmentation, config, USUAL, clock)
    found, others = [usual], other_interpretations(usual.chains, usual.evidence, usual.scene)
    if not others or usual.merged.is_refused:
        return usual
    if len(usual.pruned.chains) > MAX_UNCERTAIN_PIECES:
        return replace(usual, limit_notes=(INTERPRETATION_NOTE.format(len(usual.pruned.chains), MAX_UNCERTAIN_PIECES),))
    for other in others:
        try:
            found.append(_interpret(segmentation, config, other, clock))
        except InputError:  # there are too many of the finer voxels
            continue
    best, evidence = most_probable([each.evidence for each in found], config)
    chains = [replace(chain, confidence=each.confidence) for chain, each in zip(found[best].chains, evidence, strict=True)]
    return replace(found[best], chains=chains, evidence=evidence)


def _interpret(segmentation: Segmentation, config: Config, how: Interpretation, clock: _Clock) -> Stages:
    """Run the stages from voxelization to crossings with the frame interpreted in one way."""
    scene = segmentation.scene.asked(config, how.voxel)
    grid = voxelize(scene)
    clock("voxelize")
    skeleton = thin(grid)
    clock("thin")
    traversal = traverse(skeleton, scene, config.traverse, how.clearance)
    length = _fitted_length(traversal.paths, scene)
    clock("traverse")
    fitted = fit(traversal.paths, length, config.fit)
    clock("fit")
    pruned = prune(fitted, scene.voxel if len(fitted) else 1.0, config.prune)
    clock("prune")
    weights = {"free_space_weight": how.free_space * config.merge.free_space_weight}
    merged = merge(pruned.chains, scene, length, config.merge.model_copy(update=weights))
    clock("merge")
    filled = fill(merged.assemblies, length)
    clock("fill")
    extended = extend_ends(filled, scene, length)
    scene = decide_viewpoint(extended, scene, length)
    clock("extend_ends")
    samples = estimate_centerline(extended, scene, length, config.refine)
    clock("estimate_centerline")
    chains = lay_chains(samples, extended, grid.centroids, scene, config.refine)
    clock("lay_chains")
    branched = Branched(chains)
    if config.merge.branches:
        branched = find_branches(chains, scene)
        clock("branches")
    crossings = branched.without_junctions(find_crossings(branched.chains, scene))
    dropped = sum(item.length for item in merged.dropped if item.setting == "merge.chains")
    bodies = [item.chains for item in branched.objects]
    joined = {end for junction in branched.junctions for end in junction.ends}
    chains, evidence = with_confidence(branched.chains, dropped, scene, bodies, joined)
    clock("crossings")
    products = segmentation, scene, grid, skeleton, traversal, fitted, pruned, merged, filled, chains, crossings
    stages = Stages(*products, clock.seconds, evidence=evidence, branched=branched)
    return stages if config.merge.chains is None or not scene.ranks_by_confidence else _chosen(stages, config.merge.chains)


def _chosen(stages: Stages, count: int) -> Stages:
    """Return the stages with the wanted number of most probable chains, and the others as `unchosen`."""
    place = {k: i for i, k in enumerate(most_probable_chains(stages.chains, count))}
    chains = [stages.chains[k] for k in place]
    return replace(
        stages,
        chains=chains,
        crossings=kept_crossings(stages.crossings, place),
        evidence=[stages.evidence[k] for k in place],
        branched=Branched(chains),
        unchosen=tuple(chain for k, chain in enumerate(stages.chains) if k not in place),
    )


def object_given(stages: Stages, config: Config) -> bool:
    """Tell whether the user said what the object is, or how many there are: no chain is left out for its confidence then.

    stages : the products of a frame: by a mask, a color or other settings of the segmentation. config : `merge.chains` is used.
    """
    return stages.scene.object_given or config.merge.chains is not None


def _fitted_length(paths: list[Path], scene: Scene) -> float:
    """Return the length of the segments until the axis is known, m or px: in most frames that of the settings.

    Shorter ones follow the points of a sparse cloud, and the bends of a thin strand at a junction, with MAX_SAMPLES at most.
    """
    config = scene.config
    if not (scene.is_sparse or (config.merge.branches and config.mode == "2d")):
        return config.fit.length
    least = float(Curves.of([path.points for path in paths]).lengths.sum()) / (MAX_SAMPLES - 1)
    if scene.is_sparse:
        return max(scene.spacing / 2, least)
    return min(config.fit.length, max(STEP_RADII * scene.radius, least))


def detect(
    data: Frame | Cloud | Image | Array | FrameReference,
    config: ConfigLike | None = None,
    mask: Array | None = None,
    pose: ArrayLike | None = None,
) -> Detection:
    """Return the deformable linear objects in one frame, cloud or image as chains.

    Parameters
    ----------
    data
        a Frame or a Cloud. With a config whose `mode` is 2d: an Image, an array (H, W, 3) uint8 RGB, or a Frame with color. Or a
        frame of a capture, `capture[0]`, which is read with its mask and its camera's pose in the base frame.
    config
        the settings: a Config, the name of a preset, the path of a YAML file, or settings by dotted key over the defaults, such
        as {"merge.chains": 1}; None for the preset "default".
    mask
        the caller's own segmentation, True on the object, instead of the config's: (H, W) bool for a Frame or an image, (N,)
        bool for a Cloud made of N points, counting those with NaN. None segments as the config says.
    pose
        pose of the camera (of the cloud's frame) in the robot's base frame, m: 4x4, p_base = pose @ p_camera, or the seven
        numbers x y z qx qy qz qw. The detection is then in the base frame. None leaves it in the camera's.

    Returns
    -------
    Detection with the chains, longest first. If neither the object (by a mask, a color) nor the number of chains is given, those
    whose confidence is below `output.min_confidence` are not among them: `doubtful` has those that may be cables. Joints are in
    m, in the camera's optical frame (x right, y down, z forward) or in the frame of the cloud, or in the base frame of `pose`; in
    2-D in px. If nothing is found, there are no chains, and `notes` say where the object was lost.

    Raises
    ------
    InputError : the data cannot be used; the message says what is wrong, where, and what to do.
    ArgumentError (a TypeError) : an argument is of the wrong type.
    ConfigError : the settings cannot be used.
    """
    base_pose = None if pose is None else as_pose(pose)
    config = as_config(config)
    notes: tuple[str, ...] = ()
    if isinstance(data, FrameReference):
        loaded = data.load()
        data, notes = loaded.data, loaded.notes
        mask = loaded.mask_for(config) if mask is None else mask
        base_pose = loaded.base_pose if base_pose is None else base_pose
    detection, stages = detect_with_stages(data, config, mask)
    detection = replace(detection, notes=(*notes, *detection.notes))
    if not object_given(stages, config):
        detection = detection.confident(config.output.min_confidence)
    return detection if base_pose is None else detection.transformed(base_pose)


def detect_with_stages(
    data: Frame | Cloud | Image | Array, config: Config, mask: Array | None = None
) -> tuple[Detection, Stages]:
    """Return the detection of one frame, cloud or image in its own coordinates, and what every stage made.

    The detection has all chains, also those that `output.min_confidence` leaves out.

    data, config, mask : as for `detect`.

    Raises
    ------
    InputError : the data cannot be used; the message says what is wrong, where, and what to do.
    """
    data, stages = run_with_stages(data, config, mask)
    detection = Detection(
        chains=tuple(stages.chains),
        mode="2d" if isinstance(data, Image) else "3d",
        coordinates=data.coordinates if isinstance(data, Cloud) else "camera" if isinstance(data, Frame) else "image",
        frame=data.name,
        timestamp=data.timestamp,
        seconds=stages.seconds,
        notes=(
            *(data.notes if isinstance(data, Cloud) else _mask_notes(data, mask)),
            *filter(None, (stages.segmentation.choice if _is_doubtful(stages, config) else "",)),
            *(stages.scene.notes or _lost(stages)),
            *stages.segmentation.limits,
            *stages.traversal.notes,
            *stages.merged.notes,
            *stages.limit_notes,
            *stages.branched.notes,
            *_branch_notes(stages, config),
            *frame_notes(data, _shown_chains(stages, config), stages.scene.plane),
        ),
        crossings=stages.crossings,
        plane=stages.scene.plane,
        junctions=stages.branched.junctions,
        objects=stages.branched.objects,
    )
    return enlarged(detection, stages.scale), stages


def run_with_stages(
    data: Frame | Cloud | Image | Array, config: Config, mask: Array | None = None
) -> tuple[Frame | Cloud | Image, Stages]:
    """Convert the data to the mode of the config, run the whole method, and return what every stage made.

    Parameters
    ----------
    data
        a Frame or a Cloud. With a config whose `mode` is 2d: an Image, an array (H, W, 3) uint8 RGB, or a Frame with color.
    config
        the settings.
    mask
        the caller's own segmentation, True on the object, instead of the config's: (H, W) bool for a Frame or an image, (N,)
        bool for a Cloud made of N points, counting those with NaN. None segments as the config says.

    Returns
    -------
    data : an Image in 2-D; the Frame or Cloud in 3-D.
    stages : the product of every stage; of a large photograph in the pixels of a smaller copy (`Stages.scale`).

    Raises
    ------
    InputError : the data cannot be used; the message says what is wrong, where, and what to do.
    """
    data = as_mode_data(data, config)
    if isinstance(data, Cloud) and mask is not None:
        mask = _finite_rows(data, mask)
    return data, run_stages(data, config, mask)


def as_mode_data(data: Frame | Cloud | Image | Array, config: Config) -> Frame | Cloud | Image:
    """Convert the data to the form that the mode of the config needs: an Image in 2-D, a Frame or a Cloud in 3-D.

    Parameters
    ----------
    data
        a Frame, a Cloud, an Image, or an array (H, W, 3) uint8 RGB, which counts as an Image. In 2-D a Frame is reduced to its
        color image.
    config
        the settings; only `mode` is used.

    Raises
    ------
    InputError : the data and the mode do not fit: no color image in 2-D, no depth in 3-D, or another type.
    """
    if isinstance(data, np.ndarray):
        data = _as_image(data)
    if not isinstance(data, (Frame, Cloud, Image)):
        raise _wrong_type(data)
    if config.mode == "2d":
        if isinstance(data, Image):
            return data
        if isinstance(data, Cloud) or data.color is None:
            raise InputError(
                "the config is for images (mode: 2d), and this has no colour image: use a 3-D config, such as default",
                code="mode-needs-image",
            )
        return Image(data.color, data.name, data.timestamp)
    if isinstance(data, Image):
        raise InputError(
            "an image has no depth: use a 2-D config, such as the presets image and paper_2d (-c image)", code="mode-needs-depth"
        )
    return data


def _as_image(array: Array) -> Image:
    """Return an array as an Image, unless its shape is that of points or of depth."""
    if array.ndim == 2 and array.shape[1] == 3 and np.issubdtype(array.dtype, np.number):
        raise ArgumentError(
            f"an array of shape {array.shape} looks like {len(array)} points: give doo3d.Cloud(points), in metres",
            code="data-type",
        )
    if array.ndim == 2 and array.dtype != np.uint8:
        raise ArgumentError(
            f"an array of shape {array.shape} and type {array.dtype} looks like depth: give "
            "doo3d.Frame(color, depth, camera), with depth in metres",
            code="data-type",
        )
    return Image(array)


def _wrong_type(data: object) -> ArgumentError:
    """Return the error for an argument that is no data, with the remedy where the type tells what was meant."""
    if isinstance(data, str | os.PathLike):
        remedy = f": read a frame of it first: doo3d.open_capture({os.fspath(data)!r})[0]"
    elif hasattr(data, "data") and hasattr(data, "mask_for"):
        remedy = ": give its data: loaded.data"
    elif hasattr(data, "frames"):
        remedy = ": give one frame of it: capture[0]"
    else:
        remedy = ", expected a doo3d.Frame, a doo3d.Cloud, a doo3d.Image or an array (H, W, 3) uint8 RGB"
    return ArgumentError(f"detect was given a {type(data).__name__}{remedy}", code="data-type")


def _segment(
    data: Frame | Cloud | Image, config: Config, mask: Array | None
) -> tuple[Segmentation, Frame | Cloud | Image, Config, int]:
    """Return the segmentation, and the data and settings of the stages after it, with the factor by which the data are reduced.

    An error names the frame, unless its name is the default of its type.
    """
    try:
        if isinstance(data, Image):
            return segment_picture(data, config, mask)
        return segment(data, segment_config(config), mask, config.seed), data, config, 1
    except InputError as error:
        if data.name == type(data).__name__.lower():
            raise
        raise InputError(f"frame {data.name}: {error}", code=error.code) from None


def _finite_rows(cloud: Cloud, mask: Array) -> Array:
    mask = array(mask, "mask", "mask-shape")
    return mask[cloud.finite] if mask.shape == cloud.finite.shape else mask


def _mask_notes(data: Frame | Image, mask: Array | None) -> list[str]:
    """Return the note on a mask that was cropped or padded to the size of the image."""
    image = data.color if isinstance(data, Image) else data.depth
    return [] if mask is None else [note for note in fit_mask(np.asarray(mask), image.shape[:2])[1:] if note]


def _shown_chains(stages: Stages, config: Config) -> list[Chain]:
    """Return the chains that are not left out for their confidence."""
    if object_given(stages, config):
        return stages.chains
    return [chain for chain in stages.chains if chain.confidence >= config.output.min_confidence]


def _is_doubtful(stages: Stages, config: Config) -> bool:
    """Return whether a frame shows no chain, or one of low confidence."""
    return min((chain.confidence for chain in _shown_chains(stages, config)), default=0.0) < DOUBTFUL_CONFIDENCE


def _branch_notes(stages: Stages, config: Config) -> tuple[str, ...]:
    """Return the note on chains in space that meet like the branches of one object, which only some settings look for."""
    sure = [chain for chain in stages.chains if chain.confidence >= DOUBTFUL_CONFIDENCE]
    if config.merge.branches or config.mode == "2d" or not may_branch(sure):
        return ()
    if not find_branches(sure, stages.scene).junctions:
        return ()
    return ("branches: chains meet as the branches of one object do; if they are, use the preset harness (-c harness)",)


def _lost(stages: Stages) -> tuple[str, ...]:
    """Where everything was lost, and what to try; nothing when there are chains."""
    if stages.chains:
        return ()
    has_image = stages.scene.mask.size > 0  # of a cloud doo3d tune proposes nothing
    colors = "; doo3d tune proposes colour ranges and shows them" if has_image else ""
    mask = ", or see with doo3d tune what the mask takes" if has_image else ""
    length_hint = "lower fit.segment_length" + ("; doo3d tune proposes one" if has_image else "")
    for name, product, hint in (
        ("segment", len(stages.scene.points), f"widen the segmentation{colors}"),
        ("voxelize", len(stages.grid.coords), f"the pieces are smaller than 12 voxels: lower voxelize.size{mask}"),
        ("traverse", len(stages.paths), "lower traverse.min_branch; doo3d explain says what was dropped"),
        ("fit", len(stages.fitted), f"the object is shorter than a segment: {length_hint}"),
        ("prune", len(stages.pruned.chains), "lower prune.width"),
        ("merge", len(stages.merged.assemblies), "lower merge.min_length; doo3d explain says what was dropped"),
    ):
        if not product:
            return (f"{name}: nothing is left after this stage; {hint}",)
    return (f"refine: what is left is shorter than half a segment: {length_hint}",)
