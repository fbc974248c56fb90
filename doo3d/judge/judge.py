"""How sure the chains of a frame are: confidence, deviations, and which strand is on top where two cross."""

from collections.abc import Sequence

from ..scene.scene import Scene
from ..types import Chain, Junction, LinearObject
from .confidence import with_confidence
from .crossings import find_crossings
from .verdict import Verdict


def judge(
    chains: list[Chain], scene: Scene, dropped: float, junctions: Sequence[Junction], objects: Sequence[LinearObject]
) -> Verdict:
    """Judge the chains of a frame.

    Parameters
    ----------
    chains
        chains along the axes of the objects, m (px in 2-D).
    scene
        what was captured, with the settings.
    dropped
        length of the pieces dropped because of the wanted number of chains, m (px in 2-D).
    junctions, objects
        where chains meet, and the trees that they make; chains that meet there do not cross.

    Returns
    -------
    The chains with their confidence and the deviations of their joints, and their crossings. If a number of chains is wanted and
    the object is not given, the most probable ones are kept.
    """
    crossings = find_crossings(chains, scene, junctions)
    joined = {end for junction in junctions for end in junction.ends}
    chains, evidence = with_confidence(chains, dropped, scene, [item.chains for item in objects], joined)
    verdict = Verdict(chains, crossings, tuple(evidence))
    count = scene.config.merge.chains
    return verdict if count is None or not scene.ranks_by_confidence else verdict.of_most_probable(count)
