"""Assemble the pieces between junctions and tips to trees, and find the trunk of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.disjoint_set import DisjointSet
from ...geometry.polyline import angle, arc_length, resample, unit
from ...types import Chain, ChainEnd, Floats, Junction, LinearObject

TURN_WEIGHT = 0.3
"""Share of a chain's weight that is subtracted per radian of the turn into that chain, when the trunk is chosen."""


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
    at: dict[int, list[tuple[int, int]]] = {k: [] for k in range(len(nodes))}
    for number, piece in enumerate(pieces):
        for side, node in enumerate(piece.nodes):
            if node is not None:
                at[node].append((number, side))
    parts = DisjointSet(range(len(pieces)))
    for members in at.values():
        for number, _ in members[1:]:
            parts.join(members[0][0], number)
    bodies = [np.flatnonzero(parts.group == value).tolist() for value in dict.fromkeys(parts.group.tolist())]
    bodies.sort(key=lambda body: -sum(pieces[number].chain.length for number in body))
    order: list[int] = []
    trunks = []
    for body in bodies:
        trunk = _trunk(body, pieces, at)
        rest = sorted((number for number in body if number not in trunk), key=lambda number: -pieces[number].chain.length)
        order += [*trunk, *rest]
        trunks.append(len(trunk))
    place = {number: i for i, number in enumerate(order)}
    junctions: list[Junction] = []
    index: dict[int, int] = {}
    for node, members in sorted(at.items(), key=lambda item: min((place[number] for number, _ in item[1]), default=0)):
        if len(members) < 3:
            continue
        index[node] = len(junctions)
        met = sorted(ChainEnd(place[number], side) for number, side in members)
        radii = np.array([pieces[order[end.chain]].chain.radius for end in met])
        confidence = float(1 / (1 + np.exp(-min(nodes[node].gains) / 40)))
        junctions.append(Junction(nodes[node].position, tuple(met), radii, confidence))
    objects = []
    for body, trunk_length in zip(bodies, trunks, strict=True):
        first = min(place[number] for number in body)
        own = sorted({index[node] for number in body for node in pieces[number].nodes if node in index})
        objects.append(LinearObject(tuple(range(first, first + len(body))), tuple(own), trunk_length))
    return [pieces[number].chain for number in order], junctions, objects


def _trunk(body: Sequence[int], pieces: Sequence[Piece], at: dict[int, list[tuple[int, int]]]) -> list[int]:
    """Return the chains along the thickest path from tip to tip: the one with the greatest sum of length times radius squared."""
    if len(body) == 1:
        return list(body)
    best: tuple[float, list[int]] = (-1.0, list(body[:1]))

    def follow(number: int, entered: int, weight: float, path: list[int]) -> None:
        nonlocal best
        chain = pieces[number].chain
        weight += chain.length * chain.radius**2
        path = [*path, number]
        node = pieces[number].nodes[1 - entered]
        onwards = [] if node is None else [item for item in at[node] if item[0] not in path]
        if weight > best[0]:
            best = (weight, path)
        for other, side in onwards:
            turn = _turn(chain, entered, pieces[other].chain, side)
            follow(other, side, weight - TURN_WEIGHT * turn * pieces[other].chain.length * pieces[other].chain.radius ** 2, path)

    for number in body:
        for side, node in enumerate(pieces[number].nodes):
            if node is None:
                follow(number, side, 0.0, [])
    return best[1]


def _turn(chain: Chain, entered: int, other: Chain, side: int) -> float:
    """Return the angle in radians between the end of one chain, entered at the other end, and the start of the next."""

    def leaving(joints: Floats) -> Floats:
        along = arc_length(joints)
        return unit(resample(joints, np.array([min(along[-1], 0.03 if joints.shape[1] == 3 else 30.0)]))[0] - joints[0])

    back = leaving(chain.joints[::-1] if entered == 0 else chain.joints)
    onward = leaving(other.joints if side == 0 else other.joints[::-1])
    return float(angle(-back, onward))
