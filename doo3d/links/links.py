"""Which chain ends belong together (Keipour et al., RA-L 2022, section III-F)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..config import MergeConfig
from ..geometry.assembly import Assembly
from ..geometry.curves import Curves
from ..scene.scene import Scene
from ..types import Floats
from ..types.stopwatch import timed
from .candidates import Candidates, End, Link, ends_of
from .confidence import confidences
from .decisions import TOO_MANY, DroppedChain, Merged, record_decisions
from .greedy import ChainGroups
from .solve import solve
from .terms import cost_terms, pair_costs
from .terms.gap_path import GapPaths

MAX_CHAINS = 500
"""Chains at most whose ends are joined, the longest: the costs of all pairs of their ends, and the matching, take about a second.
A frame of an object has a few dozen."""

NO_CHAINS = Curves.of([])


@timed("merge")
def merge(chains: Curves, scene: Scene, segment_length: float, config: MergeConfig) -> Merged:
    """Decide which chain ends belong together, and put the chains of each object in order.

    Ends are connected at the lowest total cost (equation 5 of Keipour et al., RA-L 2022) until no pair is cheap enough or the
    wanted number of chains is left. The part of a gap path in free space, which the camera saw to be empty, costs extra. The
    objects of at least `config.min_length` radii are kept or, if `config.chains` is set, that number of objects, the longest. If
    the object is not given, `confidence.most_probable_chains` chooses among the objects later, since an edge may be longer than
    the cable.
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
    The objects, longest first, a record of each connection, and the chains dropped.

    Raises
    ------
    ConfigError : `merge.custom_costs` names a cost that is not registered.
    """
    if not len(chains):
        return Merged([])
    chains, left_out = _longest(chains)
    if config.free_space_weight:
        scene = scene.with_support(chains)
    ends = Candidates.of(chains, scene, segment_length, config)
    terms = cost_terms(ends, scene)
    cost = pair_costs(ends, terms, scene)
    gap_paths = GapPaths(ends, scene)
    sizes = (chains.counts - 1).tolist()
    links = solve(cost, sizes, gap_paths.costs, config, gap_paths.with_straight_gaps, gap_paths.forced_costs)
    alternatives = gap_paths.with_straight_gaps(cost)
    confidence = confidences(links, alternatives, config.max_cost, config.allow_closed_chains)

    of_end = {end: value for link, value in zip(links, confidence, strict=True) for end in link.pair}
    routes = trace_routes(chains.closed.tolist(), links)
    built = [(route, _assembly(route, chains, gap_paths, of_end)) for route in routes]
    built.sort(key=lambda item: -item[1].segments)
    least, setting = config.min_length * scene.radius, "merge.min_length"
    count = sum(assembly.segments * segment_length >= least for _, assembly in built)
    if config.chains is not None:
        count, setting = max(config.chains, count if scene.ranks_by_confidence else 0), "merge.chains"
    kept = built[:count]
    used = {end.chain for route, _ in kept for end in route.entries}
    dropped = [*((chain, setting) for i, chain in enumerate(chains) if i not in used), *((chain, TOO_MANY) for chain in left_out)]
    refusal = _refusal_notes(links, sizes, cost, gap_paths, "most probable" if scene.ranks_by_confidence else "longest")
    return Merged(
        [assembly for _, assembly in kept],
        partial(
            record_decisions, links, confidence, [link.first.chain in used for link in links], terms, alternatives, gap_paths
        ),
        tuple(DroppedChain(joints, (len(joints) - 1) * segment_length, why) for joints, why in dropped),
        (*_notes(left_out), *ends.notes, *refusal),
        bool(refusal),
    )


def _longest(chains: Curves) -> tuple[Curves, Curves]:
    """Return the MAX_CHAINS chains with the most segments, of equal ones the first, and the others, each in the order given."""
    if len(chains) <= MAX_CHAINS:
        return chains, NO_CHAINS
    order = np.argsort(-chains.counts, kind="stable").tolist()
    return chains.of_numbers(sorted(order[:MAX_CHAINS])), chains.of_numbers(sorted(order[MAX_CHAINS:]))


def _notes(left_out: Curves) -> tuple[str, ...]:
    if not len(left_out):
        return ()
    most = int(left_out.counts.max()) - 1
    return (
        f"merge: the object falls into {MAX_CHAINS + len(left_out)} pieces, of which the {MAX_CHAINS} longest are used; "
        f"{len(left_out)} pieces of at most {most} segment{'s' * (most != 1)} are left out; segment more narrowly",
    )


def _refusal_notes(links: Sequence[Link], sizes: list[int], cost: Floats, gap_paths: GapPaths, which: str) -> tuple[str, ...]:
    """Return a note if fewer chains are wanted than are left, since the others could only be joined in the open.

    which : the chains that are kept, such as "longest".
    """
    wanted = gap_paths.ends.config.chains
    if wanted is None:
        return ()
    groups = ChainGroups(len(sizes), links)
    large = groups.in_large(sizes)
    found = len(set(groups.group[large].tolist()))
    if found <= wanted:
        return ()
    first, second = np.nonzero(np.isfinite(cost) & np.repeat(large, 2) & np.repeat(large, 2)[:, None])
    apart = groups.are_apart(first, second)
    pairs = [(End(a // 2, a % 2), End(b // 2, b % 2)) for a, b in zip(first[apart].tolist(), second[apart].tolist(), strict=True)]
    if not any(gap_paths.cost(pair).open > gap_paths.ends.config.max_cost for pair in pairs):
        return ()
    kept = f"{which} is" if wanted == 1 else f"{wanted} {which} are"
    return (
        f"merge: {wanted} chain{'s' * (wanted != 1)} wanted (merge.chains), but {found} found: the camera sees bare surface or "
        f"free space between their ends, so they are not joined, and the {kept} kept; set merge.chains to {found} if these are "
        f"{found} objects",
    )


@dataclass(frozen=True)
class Route:
    """The order in which the chains of one object follow each other.

    Attributes
    ----------
    entries
        one `End` (chain and side) per chain, in the order in which the object runs through the chains: the end at which it
        enters the chain. It leaves at the other end.
    closed
        True if the last chain is connected to the first, or if the only chain is a ring.
    """

    entries: tuple[End, ...]
    closed: bool

    @property
    def gaps(self) -> list[tuple[End, End]]:
        """The two ends at each gap, in order: the end at which one chain is left, then the end at which the next is entered.

        A closed route has one more gap, from the last chain to the first.
        """
        following = [*self.entries[1:], *(self.entries[:1] if self.closed else ())]
        return [(entry.other, end) for entry, end in zip(self.entries, following, strict=False)]


def trace_routes(closed: Sequence[bool], links: Sequence[Link]) -> list[Route]:
    """Return in which order and direction the connections lead through the chains, one route per object.

    A chain without a connection is a route of its own. Routes between two free ends come first, in the order of their first ends,
    then rings that the connections close. Each chain is in exactly one route.

    Parameters
    ----------
    closed
        for each chain, whether it is a ring; links refer to chains by index.
    links
        the connections; no end is in two of them.
    """
    partner = {link.first: link.second for link in links} | {link.second: link.first for link in links}
    free = [end for end in ends_of(len(closed)) if end not in partner]
    visited: set[int] = set()
    routes = []
    for start in [*free, *(End(chain, 0) for chain in range(len(closed)))]:
        if start.chain in visited:
            continue
        entries = [start]
        while (end := partner.get(entries[-1].other)) is not None and end != start:
            entries.append(end)
        visited |= {entry.chain for entry in entries}
        routes.append(Route(tuple(entries), end is not None or closed[start.chain]))
    return routes


def _assembly(route: Route, chains: Curves, gap_paths: GapPaths, of_end: dict[End, float]) -> Assembly:
    """Return the assembly of a route; of_end : confidence of the connection of each joined end."""
    return Assembly(
        pieces=tuple(chains[end.chain][:: -1 if end.side else 1] for end in route.entries),
        gap_paths=tuple(gap_paths.path(*gap) for gap in route.gaps),
        closed=route.closed,
        confidence=tuple(of_end[before] for before, _ in route.gaps if before in of_end),
    )
