"""Export all frames in one file of arrays, bit-exact."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..types import Chain, Detection, Floats
from .motion import JointMotion, MotionExport
from .trees import graph_of


class Npz(MotionExport):
    """Export format NPZ: one NumPy file of arrays with all frames of a capture, without loss of precision.

    Each quantity, such as the joints, is one array over all chains of all frames. Arrays of offsets assign the rows to the
    chains; `arrays` lists all arrays.
    """

    summary: ClassVar[str] = "NumPy arrays of the whole capture, exact"
    suffixes: ClassVar[tuple[str, ...]] = (".npz",)
    file_per: ClassVar[Any] = "capture"
    supports_2d: ClassVar[bool] = True

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the arrays of all frames, as returned by `arrays`, as compressed NPZ; the same results give the same bytes."""
        with path.open("xb") as file:
            np.savez_compressed(file, **arrays(frames, self.motions_of(frames)))


def arrays(frames: Sequence[Detection], motions: Sequence[Sequence[JointMotion]]) -> dict[str, Any]:
    """Return the arrays of the NPZ file, for F frames with C chains, J joints and S segments in all frames together.

    Parameters
    ----------
    frames
        the frames of a capture, in order.
    motions
        the motion of each chain of each frame.

    Returns
    -------
    dict
        name -> array:

        - "schema", "units" : scalars; the units are "m", or "px" if all frames are 2-D.
        - "frames", "stamps", "coordinates" : (F,) name, time (s, NaN if unknown) and coordinate system of each frame, which is
          "camera", "cloud", "image" or "world".
        - "chain_offsets" : (F + 1,) int64; frame f has the chains chain_offsets[f] to chain_offsets[f + 1] - 1.
        - "joint_offsets" : (C + 1,) int64; chain c has the joints joint_offsets[c] to joint_offsets[c + 1] - 1.
        - "segment_offsets" : (C + 1,) int64; chain c has the segments segment_offsets[c] to segment_offsets[c + 1] - 1.
        - "joints" : (J, 3), or (J, 2) in 2-D, position of each joint, in "units".
        - "velocities", "accelerations" : (J, 3), or (J, 2) in 2-D, of each joint, in "units" per s and per s²; NaN if unknown.
        - "radii" : (J,) radius at each joint, in "units"; NaN if unknown.
        - "deviations" : (J, 2) m, standard deviation of each joint across and along the ray to it; NaN if unknown; not in 2-D.
        - "occluded" : (S,) bool, true for each occluded segment.
        - "depth_filled" : (S,) bool, true for each segment whose depth was interpolated and not measured; not in 2-D.
        - "from_time" : (S,) bool, true for each occluded segment that was filled in from other frames of a sequence.
        - "ids" : (C,) int64, id of each chain, -1 if unknown.
        - "node_offsets", "nodes", "node_is_junction", "edges", "objects" : only with branched objects (`merge.branches`);
          (F + 1,) int64 offsets of each frame's nodes; (K, 3), or (K, 2) in 2-D, position of each junction and tip; (K,) bool;
          (C, 2) int64, the nodes at the first and the last joint of each chain, as rows of "nodes"; (C,) int64, index of the
          chain's object in its frame.
        - "radius", "segment_length", "closed", "confidence" : (C,) values of each chain; lengths are in "units".
    """
    chains = [chain for frame in frames for chain in frame.chains]
    dim = 2 if frames and all(frame.mode == "2d" for frame in frames) else 3
    moving = [motion for frame in motions for motion in frame]
    counts = [len(chain.joints) for chain in chains]
    flags, vectors = np.zeros(0, dtype=bool), np.zeros((0, dim))
    depth = {}
    if dim == 3:
        depth["deviations"] = np.concatenate([np.zeros((0, 2)), *map(_deviations, chains)])
        depth["depth_filled"] = np.concatenate([flags, *(chain.depth_filled for chain in chains)])
    return {
        "schema": np.array("doo3d/chains/1"),
        "units": np.array("m" if dim == 3 else "px"),
        "frames": np.array([frame.frame for frame in frames], dtype=str),
        "stamps": np.array([np.nan if frame.timestamp is None else frame.timestamp for frame in frames], dtype=float),
        "coordinates": np.array([frame.coordinates for frame in frames], dtype=str),
        "chain_offsets": _offsets([len(frame.chains) for frame in frames]),
        "joint_offsets": _offsets(counts),
        "segment_offsets": _offsets([count - 1 for count in counts]),
        "joints": np.concatenate([vectors, *(chain.joints for chain in chains)]),
        "velocities": np.concatenate([vectors, *(motion.velocity for motion in moving)]),
        "accelerations": np.concatenate([vectors, *(motion.acceleration for motion in moving)]),
        "radii": np.concatenate([np.zeros(0), *(chain.radii for chain in chains)]),
        "occluded": np.concatenate([flags, *(chain.occluded for chain in chains)]),
        **depth,
        "from_time": np.concatenate([flags, *(chain.from_time for chain in chains)]),
        **_graph(frames, dim),
        "ids": np.array([-1 if chain.id is None else chain.id for chain in chains], dtype=np.int64),
        "radius": np.array([chain.radius for chain in chains], dtype=float),
        "segment_length": np.array([chain.segment_length for chain in chains], dtype=float),
        "closed": np.array([chain.closed for chain in chains], dtype=bool),
        "confidence": np.array([chain.confidence for chain in chains], dtype=float),
    }


def _deviations(chain: Chain) -> Floats:
    return np.full((len(chain.joints), 2), np.nan) if chain.deviations is None else chain.deviations


def _graph(frames: Sequence[Detection], dim: int) -> dict[str, Any]:
    """Return the arrays of the graph of all frames; empty if no frame has branched objects."""
    if not any(frame.objects for frame in frames):
        return {}
    graphs = [graph_of(frame) for frame in frames]
    offsets = _offsets([len(graph.positions) for graph in graphs])
    return {
        "node_offsets": offsets,
        "nodes": np.concatenate([graph.positions.reshape(-1, dim) for graph in graphs]),
        "node_is_junction": np.concatenate([graph.junction for graph in graphs]),
        "edges": np.concatenate([graph.edges + start for graph, start in zip(graphs, offsets[:-1], strict=True)]),
        "objects": np.concatenate([graph.objects for graph in graphs]),
    }


def _offsets(counts: list[int]) -> Any:
    return np.concatenate(([0], np.cumsum(counts, dtype=np.int64))).astype(np.int64)
