"""Assemble the pieces between junctions and tips to trees, and find the trunk of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...geometry.disjoint_set import DisjointSet
from ...types import Chain, ChainEnd, Floats, Junction, LinearObject


@dataclass
class Node:
    """A junction before the chains are cut: one or more meetings at one position.

    Attributes
    ----------
    position
        (D,) m (px in 2-D).
    gains
        gain of each meeting, cost units.
    bodies
        index of each strand that runs through the junction -> arc length on it, m (px in 2-D).
    ends
        rows in `FreeEnds` of the ends that are attached there.
    """

    position: Floats
    gains: list[float]
    bodies: dict[int, float]
    ends: list[int]


@dataclass(frozen=True)
class Piece:
    """A chain between two junctions or tips, with the index of the node at its first and last end (None at a tip)."""

    chain: Chain
    nodes: tuple[int | None, int | None]


def assembled(pieces: Sequence[Piece], nodes: Sequence[Node]) -> tuple[list[Chain], list[Junction], list[LinearObject]]:
    """Assemble the pieces of a frame to trees.

    pieces : all pieces. nodes : all junctions; those with fewer than three pieces are left out.

    Returns
    -------
    chains : by object, the object of the greatest total length first; in each the trunk first.
    junctions : the junctions, with confidence from the smallest gain by a logistic function.
    objects : the trees, in the order of the chains.
    """
    at: dict[int, list[ChainEnd]] = {}
    parts = DisjointSet(range(len(pieces)))
    for number, piece in enumerate(pieces):
        for side, node in enumerate(piece.nodes):
            if node is not None:
                at.setdefault(node, []).append(ChainEnd(number, side))
                parts.join(at[node][0].chain, number)
    bodies = sorted(parts.members(), key=lambda body: -sum(pieces[number].chain.length for number in body))
    order: list[int] = []
    objects = []
    for body in bodies:
        trunk = _trunk(body, pieces, at)
        objects.append(LinearObject(tuple(range(len(order), len(order) + len(body))), trunk=len(trunk)))
        order += [*trunk, *sorted(set(body).difference(trunk), key=lambda number: (-pieces[number].chain.length, number))]
    place = {number: i for i, number in enumerate(order)}
    met = [(sorted(ChainEnd(place[each.chain], each.end) for each in ends), nodes[k]) for k, ends in at.items() if len(ends) > 2]
    met.sort(key=lambda item: item[0])
    junctions = [
        Junction(
            node.position,
            tuple(ends),
            np.array([pieces[order[end.chain]].chain.radius for end in ends]),
            float(1 / (1 + np.exp(-min(node.gains) / 40))),
        )
        for ends, node in met
    ]
    objects = [
        replace(item, junctions=tuple(k for k, (ends, _) in enumerate(met) if ends[0].chain in item.chains)) for item in objects
    ]
    return [pieces[number].chain for number in order], junctions, objects


def _trunk(body: Sequence[int], pieces: Sequence[Piece], at: Mapping[int, Sequence[ChainEnd]]) -> list[int]:
    """Return the chains along the thickest path from tip to tip: the one with the greatest sum of length times radius squared."""

    def heaviest(entered: ChainEnd, path: list[int]) -> tuple[float, list[int]]:
        chain, path = pieces[entered.chain].chain, [*path, entered.chain]
        node = pieces[entered.chain].nodes[1 - entered.end]
        onwards = [] if node is None else [heaviest(each, path) for each in at[node] if each.chain not in path]
        weight, path = max(onwards, key=lambda item: item[0], default=(0.0, path))
        return weight + chain.length * chain.radius**2, path

    tips = [ChainEnd(number, side) for number in body for side in (0, 1) if pieces[number].nodes[side] is None]
    return max((heaviest(tip, []) for tip in tips), key=lambda item: item[0], default=(0.0, list(body[:1])))[1]
