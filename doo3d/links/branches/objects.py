"""Assemble the pieces between junctions and tips to trees, and find the trunk of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.disjoint_set import DisjointSet
from ...types import Chain, ChainEnd, Floats, Junction, LinearObject
from ..ends import End


@dataclass
class Node:
    """A junction before the chains are cut: one or more contacts at one position.

    Attributes
    ----------
    position
        (D,) m (px in 2-D).
    gains
        gain of each contact, cost units.
    bodies
        index of each strand that runs through the junction -> arc length on it, m (px in 2-D).
    ends
        the ends that are attached there.
    """

    position: Floats
    gains: list[float]
    bodies: dict[int, float]
    ends: list[End]


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
    at, parts = _ends_at_nodes(pieces), DisjointSet(range(len(pieces)))
    for first, *others in at.values():
        for end in others:
            parts.join(first.chain, end.chain)
    trees = []
    for body in sorted(parts.members(), key=lambda body: -sum(pieces[number].chain.length for number in body)):
        trunk = _trunk(body, pieces, at)
        rest = sorted(set(body).difference(trunk), key=lambda number: (-pieces[number].chain.length, number))
        trees.append(([*trunk, *rest], len(trunk)))
    places = {k: (node.position, float(1 / (1 + np.exp(-min(node.gains) / 40)))) for k, node in enumerate(nodes)}
    return laid_out(trees, pieces, places)


def laid_out(
    trees: Sequence[tuple[Sequence[int], int]], pieces: Sequence[Piece], places: Mapping[int, tuple[Floats, float]]
) -> tuple[list[Chain], list[Junction], list[LinearObject]]:
    """Return the chains, junctions and objects of a frame, as `Detection` holds them.

    Parameters
    ----------
    trees
        for each object the numbers of its pieces, those of the trunk first, and how many these are.
    pieces
        all pieces.
    places
        position, (D,) m (px in 2-D), and confidence of each node; those at which fewer than three pieces end are left out.
    """
    ordered = [pieces[number] for numbers, _ in trees for number in numbers]
    met = sorted((ends, node) for node, ends in _ends_at_nodes(ordered).items() if len(ends) > 2)
    junctions, objects, first = [], list[LinearObject](), 0
    for ends, node in met:
        position, confidence = places[node]
        radii = np.array([ordered[end.chain].chain.radius for end in ends])
        junctions.append(Junction(position, tuple(ends), radii, confidence))
    for numbers, trunk in trees:
        own = range(first, first + len(numbers))
        objects.append(LinearObject(tuple(own), tuple(k for k, (ends, _) in enumerate(met) if ends[0].chain in own), trunk))
        first += len(numbers)
    return [piece.chain for piece in ordered], junctions, objects


def _ends_at_nodes(pieces: Sequence[Piece]) -> dict[int, list[ChainEnd]]:
    """Return the ends of pieces at each node, in the order of the pieces."""
    at: dict[int, list[ChainEnd]] = {}
    for end in (ChainEnd(number, side) for number in range(len(pieces)) for side in (0, 1)):
        node = pieces[end.chain].nodes[end.end]
        if node is not None:
            at.setdefault(node, []).append(end)
    return at


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
