"""Which chain ends belong together (Keipour et al., RA-L 2022, section III-F)."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from ..config import MergeConfig
from ..geometry.assembly import Assembly
from ..geometry.curves import Curves
from ..geometry.gap_path import GapPath
from ..scene.scene import Scene
from ..types import Floats
from ..types.stopwatch import timed
from .cheapest import Groups
from .confidence import confidences
from .decisions import TOO_MANY, DroppedChain, Merged, record_decisions
from .ends import End, Ends, Link, ends_of
from .solve import solve
from .terms import cost_terms, pair_costs
from .terms.gap_path import GapPaths

MAX_CHAINS = 500
"""Number of chains whose ends are linked, the longest: the costs of all pairs of their ends, and the matching, take about a
second. A frame of an object has a few dozen."""


EXIT_CONFIDENCE = 0.9
"""Confidence of a strand's way out of the image beneath others: 10 of 10 were right in photographs of bundles, and one more of
each is counted."""


@timed("merge")
def merge(chains: Curves, scene: Scene, segment_length: float, config: MergeConfig) -> Merged:
    """Decide which chain ends belong together, and put the chains of each object in order.

    Ends are linked at the lowest total cost (equation 5 of Keipour et al., RA-L 2022) until no pair is cheap enough or the wanted
    number of chains is left. The length of a gap path in free space, which the camera saw to be empty, costs extra. The objects
    of at least `config.min_length` radii are kept or, if `config.chains` is set, that number of objects, the longest. If the
    object is not given, the judge chooses among the objects later, since an edge may be longer than the cable.
    Of more than MAX_CHAINS (500) chains only the longest are used, and a note says so.

    Parameters
    ----------
    chains
        the joints of the chains that pruning left.
    scene
        what was captured.
    segment_length
        m (px in 2-D), of the chains.
    config
        section `merge` of the settings.

    Returns
    -------
    The objects, longest first, a record of each link, and the chains dropped.

    Raises
    ------
    ConfigError : `merge.custom_costs` names a cost that is not registered.
    """
    if not len(chains):
        return Merged([])
    chains, left_out = _longest(chains)
    if config.free_space_weight:
        scene = scene.with_support(chains)
    ends = Ends.of(chains, scene, segment_length, config)
    terms = cost_terms(ends, scene)
    cost = pair_costs(ends, terms, scene)
    gap_paths, sizes = GapPaths(ends, scene), chains.counts - 1
    links = solve(cost, sizes, gap_paths.costs, config, gap_paths.with_straight_gaps, gap_paths.forced_costs)
    alternatives = gap_paths.with_straight_gaps(cost)
    confidence = confidences(links, alternatives, config.max_cost, config.allow_closed_chains)

    of_end = {end: value for link, value in zip(links, confidence, strict=True) for end in link.pair}
    built = [(route[0], _assembly(*route, chains, gap_paths, of_end)) for route in trace_routes(chains.closed.tolist(), links)]
    built.sort(key=lambda item: -item[1].segments)
    count = sum(assembly.segments * segment_length >= config.min_length * scene.radius for _, assembly in built)
    if config.chains is not None:
        count = max(config.chains, count if scene.ranks_by_confidence else 0)
    used = {end.chain for entries, _ in built[:count] for end in entries}
    kept = [link.first.chain in used for link in links]
    setting = "merge.min_length" if config.chains is None else "merge.chains"
    dropped = [*((chain, setting) for i, chain in enumerate(chains) if i not in used), *((chain, TOO_MANY) for chain in left_out)]
    refusal = _refusal_notes(Groups(sizes, links), cost, gap_paths, "most probable" if scene.ranks_by_confidence else "longest")
    return Merged(
        [assembly for _, assembly in built[:count]],
        partial(record_decisions, links, confidence, kept, terms, alternatives, gap_paths),
        tuple(DroppedChain(joints, (len(joints) - 1) * segment_length, why) for joints, why in dropped),
        (*_notes(left_out), *ends.notes, *refusal),
        bool(refusal),
    )


def _longest(chains: Curves) -> tuple[Curves, Curves]:
    """Return the MAX_CHAINS chains with the most segments, of equal ones the first, and the others, each in the order given."""
    if len(chains) <= MAX_CHAINS:
        return chains, Curves.of([])
    order = np.argsort(-chains.counts, kind="stable").tolist()
    return chains.of_numbers(sorted(order[:MAX_CHAINS])), chains.of_numbers(sorted(order[MAX_CHAINS:]))


def _notes(left_out: Curves) -> tuple[str, ...]:
    """Return the note on chains that were left out since there are too many."""
    if not len(left_out):
        return ()
    most = int(left_out.counts.max()) - 1
    return (
        f"merge: the object falls into {MAX_CHAINS + len(left_out)} pieces, of which the {MAX_CHAINS} longest are used; "
        f"{len(left_out)} pieces of at most {most} segment{'s' * (most != 1)} are left out; segment more narrowly",
    )


def _refusal_notes(groups: Groups, cost: Floats, gap_paths: GapPaths, which: str) -> tuple[str, ...]:
    """Return a note if more chains are left than are wanted, since the others could only be linked in the open.

    Parameters
    ----------
    groups
        the groups of chains that are linked.
    cost
        (E, E) cost units, cost of linking each pair of ends; infinite where a link is not allowed.
    gap_paths
        the costs of the gaps.
    which
        the chains that are kept, such as "longest".
    """
    config = gap_paths.ends.config
    found = len(set(groups.group[groups.is_large].tolist()))
    if config.chains is None or found <= config.chains:
        return ()
    large = np.repeat(groups.is_large, 2)
    first, second = np.nonzero(np.isfinite(cost) & large & large[:, None])
    apart = groups.are_apart(first, second)
    pairs = zip(first[apart].tolist(), second[apart].tolist(), strict=True)
    if not any(gap_paths.cost((End.at(a), End.at(b))).open > config.max_cost for a, b in pairs):
        return ()
    wanted = config.chains
    kept = f"{which} is" if wanted == 1 else f"{wanted} {which} are"
    return (
        f"merge: {wanted} chain{'s' * (wanted != 1)} wanted (merge.chains), but {found} found: the camera sees bare surface or "
        f"free space between their ends, so they are not joined, and the {kept} kept; set merge.chains to {found} if these are "
        f"{found} objects",
    )


def trace_routes(closed: Sequence[bool], links: Sequence[Link]) -> list[tuple[list[End], bool]]:
    """Return in which order and direction the links lead through the chains, one route per object.

    Routes between two free ends come first, in the order of their first ends, then rings that the links close. Each chain is in
    exactly one route, a chain without a link in a route of its own.

    Parameters
    ----------
    closed
        for each chain, whether it is a ring; links refer to chains by index.
    links
        the links; no end is in two of them.

    Returns
    -------
    For each object the ends at which it enters its chains, in order; it leaves each chain at the other end. And whether the last
    chain is linked to the first, or the only chain is a ring.
    """
    partner = {link.first: link.second for link in links} | {link.second: link.first for link in links}
    ends = ends_of(len(closed))
    visited: set[int] = set()
    routes = []
    for start in [*(end for end in ends if end not in partner), *ends[::2]]:
        if start.chain in visited:
            continue
        entries = [start]
        while (end := partner.get(entries[-1].other, start)) != start:
            entries.append(end)
        visited |= {entry.chain for entry in entries}
        routes.append((entries, start in partner or closed[start.chain]))
    return routes


def _assembly(
    entries: Sequence[End], is_ring: bool, chains: Curves, gap_paths: GapPaths, of_end: Mapping[End, float]
) -> Assembly:
    """Return the assembly of a route.

    Parameters
    ----------
    entries, is_ring
        the route, as `trace_routes` returns it.
    chains
        the joints of all chains.
    gap_paths
        the paths across gaps.
    of_end
        confidence of the link of each linked end.
    """
    gaps = list(zip((entry.other for entry in entries), [*entries[1:], *entries[:is_ring]], strict=False))
    pieces = [chains[end.chain][:: -1 if end.side else 1] for end in entries]
    paths = [gap_paths.path(*gap) for gap in gaps]
    confidence = [of_end[before] for before, _ in gaps if before in of_end]
    exits = {} if is_ring else gap_paths.ends.exits
    if (way := exits.get(entries[0].row)) is not None:
        paths.insert(0, GapPath.along(np.concatenate((way[-2::-1], pieces[0][:1]))))
        pieces.insert(0, way[:-3:-1])
        confidence.insert(0, EXIT_CONFIDENCE)
    if (way := exits.get(entries[-1].other.row)) is not None:
        paths.append(GapPath.along(np.concatenate((pieces[-1][-1:], way[:-1]))))
        pieces.append(way[-2:])
        confidence.append(EXIT_CONFIDENCE)
    return Assembly(tuple(pieces), tuple(paths), is_ring, tuple(confidence))
