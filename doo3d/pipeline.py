"""One frame through the method: the page to read first."""

from dataclasses import dataclass, field, replace
from functools import partial

from numpy.typing import ArrayLike

from .chains.fill import fill
from .chains.fit import fit
from .chains.prune import Pruned, prune
from .chains.refine import refine
from .config import Config, ConfigLike, as_config
from .geometry.curves import Curves
from .judge import Evidence, Interpretation, Verdict, interpret, judge
from .judge.notes import coil_notes, lost_notes
from .links import Merged, merge
from .links.branches import Branched, branch, branch_notes
from .scene.scene import Scene
from .segment.observe import Observed, observe
from .segment.working_picture import enlarged
from .skeleton.graph import Graph, skeletonize
from .types import Array, Chain, Cloud, Crossing, Detection, Frame, Image, Path, as_pose
from .types.conversions import FrameReference, as_mode_data, finite_rows, mask_notes
from .types.display import DOUBTFUL_CONFIDENCE
from .types.plausibility import frame_notes
from .types.stopwatch import stopwatch


@dataclass
class Stages:
    """What every stage made of one frame.

    Attributes
    ----------
    observed
        the frame segmented; of a large photograph a smaller copy, in whose pixels all else is given (`Observed.scale`).
    scene
        what was captured, as the stages asked it.
    graph
        voxels, skeleton, and the ordered paths along it.
    fitted
        chains of equal segments along these paths.
    pruned
        the chains without overlapping segments, and the segments removed.
    merged
        which chains are linked to one object, each link with its cost, and the chains dropped.
    filled
        one polyline per object, its gaps filled.
    branched
        junctions and trees of chains; none without `merge.branches`.
    verdict
        the result: chains along the object's axis, longest first, with their confidence, and where they cross.
    limit_notes
        messages to the user: that the mask was not extended, or the frame interpreted in one way only, since there were too many
        chains or pieces.
    seconds
        name of the stage -> s.
    """

    observed: Observed
    scene: Scene
    graph: Graph
    fitted: Curves
    pruned: Pruned
    merged: Merged
    filled: list[Path]
    branched: Branched
    verdict: Verdict
    limit_notes: tuple[str, ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def chains(self) -> list[Chain]:
        """The chains found, longest first, m (px in 2-D)."""
        return self.verdict.chains

    @property
    def crossings(self) -> tuple[Crossing, ...]:
        """Where strands cross in the view, and which is on top."""
        return self.verdict.crossings

    @property
    def evidence(self) -> tuple[Evidence, ...]:
        """What speaks against each chain."""
        return self.verdict.evidence

    @property
    def pieces(self) -> int:
        """The number of chains that pruning left."""
        return len(self.pruned.chains)

    @property
    def is_refused(self) -> bool:
        """Whether fewer chains are wanted than could be joined where the camera sees the object."""
        return self.merged.is_refused

    @property
    def is_given(self) -> bool:
        """Whether the user said what the object is, or how many there are: no chain is left out for its confidence then."""
        return self.scene.object_given or self.scene.config.merge.chains is not None

    @property
    def shown(self) -> list[Chain]:
        """The chains that are not left out for their confidence."""
        return [chain for chain in self.chains if self.is_given or chain.confidence >= self.scene.config.output.min_confidence]


def _walk(observed: Observed, how: Interpretation) -> Stages:
    """Run the method from the segmented frame to the verdict, interpreted in one way.

    Segmentation, skeleton, ordered paths, segments, pruning, merging and filling are sections III-A to III-G of Keipour et al.
    (RA-L 2022); the axis, the branches and the judgement are this project's.
    """
    config = how.applied(observed.config)
    scene = observed.segmentation.scene.with_settings(config, how.voxel)
    graph = skeletonize(scene, how.clearance)  # III-B, C: voxelize, thin, traverse; also says how long the first segments are
    fitted = fit(graph.paths, graph.segment_length, config.fit)  # III-D: chains of equal segments
    pruned = prune(fitted, graph.grid.size, config.prune, scene.layer_of(fitted))  # III-E: without overlaps
    merged = merge(pruned.chains, scene, graph.segment_length, config.merge)  # III-F: which ends belong together
    filled = fill(merged.assemblies, graph.segment_length)  # III-G: gaps closed by tangent circles
    chains, scene = refine(filled, graph.grid.centroids, scene, graph.segment_length)  # axis, radius; a cloud's sensor
    branched = branch(chains, scene)  # trees, where objects may branch
    verdict = judge(branched.chains, scene, merged.dropped_length, branched.junctions, branched.objects)
    return Stages(observed, scene, graph, fitted, pruned, merged, filled, branched, verdict)


def run_stages(data: Frame | Cloud | Image | Array, config: Config, mask: Array | None = None) -> Stages:
    """Run the whole method on one frame and return what every stage made.

    Parameters
    ----------
    data
        a Frame or a Cloud. With a config whose `mode` is 2d: an Image, an array (H, W, 3) uint8 RGB, or a Frame with color.
    config
        the settings of all stages.
    mask
        the caller's own segmentation, True on the object, instead of the config's: (H, W) bool for a Frame or an image, (N,)
        bool for a Cloud made of N points, counting those with NaN. None segments as the config says.

    Raises
    ------
    InputError : the data cannot be used; the message says what is wrong, where, and what to do.
    """
    data = as_mode_data(data, config.mode)
    mask = finite_rows(data, mask) if isinstance(data, Cloud) and mask is not None else mask
    with stopwatch() as seconds:
        observed: Observed | None = observe(data, config, mask)
        while observed is not None:  # a photograph again, its mask extended, while strands continue beyond it (3 times at most)
            stages, verdict, notes = interpret(partial(_walk, observed))
            observed = observed.extended(verdict.chains)
    return replace(stages, verdict=verdict, limit_notes=(*notes, *stages.observed.note(verdict.chains)), seconds=dict(seconds))


def detect(
    data: Frame | Cloud | Image | Array | FrameReference,
    config: ConfigLike | None = None,
    mask: Array | None = None,
    pose: ArrayLike | None = None,
    all_chains: bool = False,
) -> Detection:
    """Return the chains of one frame, cloud or image; parameters, result and errors are those of `doo3d.detect`.

    all_chains : True returns all chains, also those whose confidence is below `output.min_confidence`.
    """
    base_pose = None if pose is None else as_pose(pose)
    config = as_config(config)
    notes: tuple[str, ...] = ()
    if isinstance(data, FrameReference):
        loaded = data.load()
        data, notes, base_pose = loaded.data, loaded.notes, loaded.base_pose if base_pose is None else base_pose
        mask = loaded.mask_for(config) if mask is None else mask
    detection, stages = detect_with_stages(data, config, mask)
    detection = replace(detection, notes=(*notes, *detection.notes)) if notes else detection
    if not (stages.is_given or all_chains):
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
    data = as_mode_data(data, config.mode)
    stages = run_stages(data, config, mask)
    segmentation, scene = stages.observed.segmentation, stages.scene
    is_doubtful = min((chain.confidence for chain in stages.shown), default=0.0) < DOUBTFUL_CONFIDENCE
    left = len(scene.points), len(stages.graph.grid.coords), len(stages.graph.paths), len(stages.fitted)
    detection = Detection(
        chains=tuple(stages.chains),
        mode="2d" if isinstance(data, Image) else "3d",
        coordinates=data.coordinates if isinstance(data, Cloud) else "camera" if isinstance(data, Frame) else "image",
        frame=data.name,
        timestamp=data.timestamp,
        seconds=stages.seconds,
        notes=(
            *(data.notes if isinstance(data, Cloud) else mask_notes(data, mask)),
            *((segmentation.choice,) if segmentation.choice and is_doubtful else ()),
            *(scene.notes or lost_notes((*left, stages.pieces, len(stages.merged.assemblies), len(stages.chains)), scene)),
            *segmentation.limits,
            *stages.graph.traversal.notes,
            *stages.merged.notes,
            *stages.limit_notes,
            *stages.branched.notes,
            *branch_notes(stages.chains, scene),
            *coil_notes(stages.chains, scene),
            *frame_notes(data, stages.shown, scene.plane),
        ),
        crossings=stages.crossings,
        plane=scene.plane,
        junctions=stages.branched.junctions,
        objects=stages.branched.objects,
        view=stages.observed.view(data),
    )
    return enlarged(detection, stages.observed.scale), stages
