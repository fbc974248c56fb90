"""Read tubes in a bin from a text file of straight cylinders.

First line: the number of tubes. Then per tube `id nodes edges`; nodes `id x y z radius`; edges, of which only the name
`e_a_b` and the two nodes a and b are used. Metres, z up, the bin's floor at z = 0. The edges give the order of a tube's
nodes, the file does not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.random import Generator

from ...errors import InputError, unread_code
from ...geometry.polyline import densify
from ...types import Floats
from .families import Size
from .model import Scene, Truth
from .stacking import AXIS_SPACING
from .studio import cable_color, make_studio

DISTANCE_FACTOR, MAX_DISTANCE = 1.05, 2.5
"""Factor by which the camera is moved back until all tubes are in view, and its greatest distance in m."""


def read_tubes(path: str | Path) -> list[tuple[Floats, float]]:
    """Read a tube configuration: (nodes, radius) of each tube, (K, 3) m from end to end, and m.

    A tube configuration is a text file of tubes, each a sequence of straight cylinders from node to node. The nodes are in the
    file's frame: z up, the bin's floor at z = 0.

    Raises
    ------
    InputError : the file cannot be read, or is not a tube configuration.
    """
    try:
        words = iter(Path(path).read_text(encoding="utf-8").split())
        return [_read_tube(words) for _ in range(int(next(words)))]
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})", code=unread_code(error)) from None
    except (ValueError, KeyError, StopIteration, RuntimeError) as error:
        raise InputError(f"{path}: is not a tube configuration ({error!r})", code="tubes-invalid") from None


def _read_tube(words: Iterator[str]) -> tuple[Floats, float]:
    _, nodes, edges = (int(next(words)) for _ in range(3))
    positions, radius = {}, 0.0
    for _ in range(nodes):
        name, x, y, z, radius = (float(next(words)) for _ in range(5))
        positions[int(name)] = (x, y, z)
    pairs = []
    for _ in range(edges):
        row = [next(words) for _ in range(13)]
        pairs.append((int(row[1]), int(row[2])))
    order = _ordered_nodes(pairs)
    return np.array([positions[name] for name in order]), radius


def _ordered_nodes(pairs: list[tuple[int, int]]) -> list[int]:
    """Return the nodes from one end to the other."""
    neighbors: dict[int, list[int]] = {}
    for a, b in pairs:
        neighbors.setdefault(a, []).append(b)
        neighbors.setdefault(b, []).append(a)
    order = [min(name for name, others in neighbors.items() if len(others) == 1)]
    while len(order) <= len(pairs):
        order.append(next(name for name in neighbors[order[-1]] if name not in order[-2:-1]))
    return order


def tubes(path: str | Path, rng: Generator, size: Size) -> Scene | None:
    """Return the scene of the tubes in a bin, seen from above, without the bin's walls.

    The camera is far enough away to see all tubes.

    Parameters
    ----------
    path
        a tube configuration: a text file of tubes made of straight cylinders.
    rng
        the random numbers of the camera and the color.
    size
        (width, height) px of the image.

    Returns
    -------
    The scene in the camera's optical frame; None if the camera would be more than 2.5 m away: then draw again from `rng`.

    Raises
    ------
    InputError : the file cannot be read, or is not a tube configuration.
    """
    studio = make_studio(rng, size, (0.8, 1.1), 8.0)
    color = cable_color(rng)
    centerlines = [(densify(nodes, AXIS_SPACING), radius) for nodes, radius in read_tubes(path)]
    while not all(studio.contains(axis) for axis, _ in centerlines):
        studio = replace(studio, distance=DISTANCE_FACTOR * studio.distance)
        if studio.distance > MAX_DISTANCE:
            return None
    cables = tuple(Truth(studio.to_camera(axis), radius, color=color) for axis, radius in centerlines)
    return Scene("", "", 0, studio.camera, cables, (), studio.table(), studio.light)
