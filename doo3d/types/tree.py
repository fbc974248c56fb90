"""Define branched objects: junctions where chain ends meet, and the trees of chains that they form."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from .arrays import Floats, set_sealed


class ChainEnd(NamedTuple):
    """Reference to one end of one chain in a detection.

    Attributes
    ----------
    chain
        index of the chain in `Detection.chains`.
    end
        0 for the chain's first joint, 1 for its last.
    """

    chain: int
    end: int


@dataclass(frozen=True)
class Junction:
    """A place where three or more strands of one body meet.

    Attributes
    ----------
    position
        (D,) m (px in 2-D), point where the axes meet, in the coordinates of the joints.
    ends
        the chain ends that meet there. Their joints are within half a segment of `position`.
    radii
        (E,) m (px in 2-D), radius of each of these E chains beside the junction.
    confidence
        0 to 1, that the strands are joined here and do not merely cross, touch or end near each other.
    """

    position: Floats
    ends: tuple[ChainEnd, ...]
    radii: Floats
    confidence: float = 1.0

    def __post_init__(self) -> None:
        set_sealed(self, position=np.asarray(self.position, dtype=float), radii=np.asarray(self.radii, dtype=float))

    def to_dict(self) -> dict[str, Any]:
        """Return the junction as plain lists and numbers, ready for JSON.

        Keys: "position" in m (px in 2-D), "ends" (each {"chain", "end"}), "radii" in m (px in 2-D) and "confidence".
        """
        return {
            "position": self.position.tolist(),
            "ends": [end._asdict() for end in self.ends],
            "radii": self.radii.tolist(),
            "confidence": self.confidence,
        }


@dataclass(frozen=True)
class LinearObject:
    """One connected body: the chains that junctions join, and these junctions. A single cable is one chain without junctions.

    Attributes
    ----------
    chains
        indices in `Detection.chains`: the trunk's chains first, in order along it, then the branches.
    junctions
        indices in `Detection.junctions`.
    trunk
        number of the first `chains` that form the trunk, the longest and thickest path through the object from tip to tip.
    """

    chains: tuple[int, ...]
    junctions: tuple[int, ...] = ()
    trunk: int = 1

    def to_dict(self) -> dict[str, Any]:
        """Return the object as plain lists and numbers, ready for JSON. Keys: "chains", "junctions" and "trunk"."""
        return {"chains": list(self.chains), "junctions": list(self.junctions), "trunk": self.trunk}


def kept_trees(
    junctions: tuple[Junction, ...], objects: tuple[LinearObject, ...], place: dict[int, int]
) -> tuple[tuple[Junction, ...], tuple[LinearObject, ...]]:
    """Return the junctions and objects whose chains are kept, with the new indices of chains and junctions.

    Parameters
    ----------
    junctions, objects
        those of a detection; either all or no chains of an object are kept.
    place
        index of a kept chain in the detection -> its new index.
    """
    kept = [number for number, junction in enumerate(junctions) if junction.ends[0].chain in place]
    number_of = {number: i for i, number in enumerate(kept)}
    ends = [tuple(end._replace(chain=place[end.chain]) for end in junctions[number].ends) for number in kept]
    trees = [
        replace(
            item, chains=tuple(place[k] for k in item.chains), junctions=tuple(number_of[number] for number in item.junctions)
        )
        for item in objects
        if item.chains[0] in place
    ]
    return tuple(replace(junctions[number], ends=met) for number, met in zip(kept, ends, strict=True)), tuple(trees)
