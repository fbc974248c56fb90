"""3-D against 2-D: whether the chains of the two modes, seen in the image, are the same chains.

Either's chains are walked along on the other's: each point has to find a place there within the tolerance, and the places
have to follow each other, forwards or backwards, without a jump. Where one goes on and the other does not, or goes on
elsewhere, there is a jump in one of the two walks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..geometry.curve_alignment import STEP, Line, Walk, resampled, walk
from ..types import Array, Camera, Chain, Floats, Frame, Image

if TYPE_CHECKING:
    from ..config import Config

TOLERANCE = 2.0  # px; or half the width of the 2-D chain, where that is more


@dataclass(frozen=True)
class Place:
    """Where the two differ.

    at : (x, y) px. distance, tolerance : px; the distance is None where the order differs. what : in words.
    """

    at: tuple[float, float]
    what: str
    distance: float | None
    tolerance: float

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words."""
        return {"at": list(self.at), "what": self.what, "distance": self.distance, "tolerance": self.tolerance}


@dataclass(frozen=True)
class Comparison:
    """One frame both ways.

    solid, flat : per chain its joints in the image, (N + 1, 2) px, of the 3-D mode and of the 2-D mode. largest, rms :
    px, of the distances from the 3-D chains to the 2-D chains; NaN where one of them has none. tolerance : px, where the
    distance is largest. places : where they differ; none when they agree.
    """

    solid: tuple[Floats, ...]
    flat: tuple[Floats, ...]
    largest: float
    rms: float
    tolerance: float
    places: tuple[Place, ...]

    @property
    def agrees(self) -> bool:
        """The same chains, within the tolerance, in the same order."""
        return not self.places

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words."""
        return {
            "agrees": self.agrees,
            "chains_3d": len(self.solid),
            "chains_2d": len(self.flat),
            "largest": self.largest,
            "rms": self.rms,
            "tolerance": self.tolerance,
            "places": [place.to_dict() for place in self.places],
        }


def compare(frame: Frame, config: Config, flat_config: Config, mask: Array | None = None) -> Comparison:
    """Detect in a frame both ways, from one and the same mask, and compare.

    Parameters
    ----------
    frame : with or without colour. config, flat_config : of the 3-D and of the 2-D mode.
    mask : (H, W) bool; None: what the 3-D mode takes for the object.

    Raises
    ------
    InputError : nothing can be detected in it.
    """
    from ..pipeline import detect, run_stages

    stages = run_stages(frame, config, mask)
    seen = stages.context.foreground.mask
    if seen is None or not seen.any():
        raise InputError(
            "; ".join(stages.context.foreground.notes) or "there is no pixel of an object to compare", code="object-missing"
        )
    color = frame.color if frame.color is not None else np.zeros((*frame.depth.shape, 3), np.uint8)
    return compare_chains(stages.chains, frame.camera, detect(Image(color), flat_config, seen).chains)


def compare_chains(solid: Sequence[Chain], camera: Camera, flat: Sequence[Chain]) -> Comparison:
    """Compare 3-D chains (m, camera frame) with 2-D chains (px) in the camera's image.

    An open chain may go on beyond the other's end by a segment, straight on: both are whole numbers of segments long.
    """
    seen = [_projected(chain, camera) for chain in solid]
    ours = [resampled(joints, np.zeros(len(joints)), chain.closed) for joints, chain in zip(seen, solid, strict=True)]
    theirs = [resampled(chain.joints, np.where(chain.radii > 0, chain.radii, 0.0), chain.closed) for chain in flat]
    beyond = max([_step(joints) for joints in seen] + [chain.segment_length for chain in flat], default=0.0)
    there = [walk(line, theirs, beyond, TOLERANCE) for line in ours]
    back = [walk(line, ours, beyond, TOLERANCE) for line in theirs]
    places = [place for i, way in enumerate(there) for place in _places(way, ours[i], f"3-D chain {i + 1}", "2-D")]
    known = np.array([place.at for place in places if place.distance is None]).reshape(-1, 2)
    for i, way in enumerate(back):
        for place in _places(way, theirs[i], f"2-D chain {i + 1}", "3-D"):
            near = np.linalg.norm(known - place.at, axis=1) < beyond + 2 * place.tolerance
            if place.distance is not None or not near.any():
                places.append(place)
    gaps = np.concatenate([way.distance for way in there] or [np.zeros(0)])
    allowed = np.concatenate([way.tolerance for way in there] or [np.zeros(0)])
    largest = int(np.argmax(gaps)) if len(gaps) else 0
    known_gaps = bool(len(gaps) and np.isfinite(gaps).all())
    return Comparison(
        solid=tuple(seen),
        flat=tuple(chain.joints for chain in flat),
        largest=float(gaps[largest]) if known_gaps else float("nan"),
        rms=float(np.sqrt((gaps**2).mean())) if known_gaps else float("nan"),
        tolerance=float(allowed[largest]) if known_gaps else TOLERANCE,
        places=tuple(places),
    )


def _projected(chain: Chain, camera: Camera) -> Floats:
    """(N + 1, 2) px; joints that are not before the camera are left out."""
    pixels = camera.project(chain.joints)
    return np.asarray(pixels[np.isfinite(pixels).all(axis=1)])


def _step(joints: Floats) -> float:
    """px, the longest step between two joints."""
    return float(np.linalg.norm(np.diff(joints, axis=0), axis=1).max(initial=0.0))


def _places(way: Walk, line: Line, name: str, others: str) -> list[Place]:
    """Where a walk leaves the others' chains, the worst point of each stretch; and where it jumps."""
    places = []
    apart = np.concatenate(([False], way.distance > way.tolerance, [False]))
    for start, stop in np.flatnonzero(np.diff(apart.astype(int))).reshape(-1, 2).tolist():
        worst = start + int(np.argmax(way.distance[start:stop] / way.tolerance[start:stop]))
        gap, allowed = float(way.distance[worst]), float(way.tolerance[worst])
        length = max(float(line.arcs[stop - 1] - line.arcs[start]), STEP)
        beside = f"{gap:.1f} px beside the nearest {others} chain" if np.isfinite(gap) else f"where there is no {others} chain"
        what = f"{name} runs {beside} ({allowed:.1f} px are allowed), over {length:.0f} px"
        places.append(Place(_point(line, worst), what, gap, allowed))
    for before, after in way.jumps:
        here, there = (f"{others} chain {way.line[k] + 1} at {max(round(way.arc[k]), 0)} px" for k in (before, after))
        middle = (before + after) // 2
        places.append(Place(_point(line, middle), f"{name} goes from {here} to {there}", None, float(way.tolerance[middle])))
    return places


def _point(line: Line, index: int) -> tuple[float, float]:
    x, y = line.points[index]
    return float(x), float(y)
