"""Tubes in a bin, read from a text file of straight cylinders.

First line: the number of tubes. Then per tube `id nodes edges`; nodes `id x y z radius`; edges, of which the name
`e_a_b` and the two nodes a and b count. Metres, z up, the bin's floor at z = 0. A tube's nodes are in the order of
its edges, not of the file.
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
from .stacking import SPACING
from .studio import cable_color, make_studio

STEP_BACK, FARTHEST = 1.05, 2.5  # the camera goes back by this factor until all is in view, m at most


def read_tubes(path: str | Path) -> list[tuple[Floats, float]]:
    """Each tube's nodes (K, 3) m in order, and its radius in m.

    Raises
    ------
    InputError : the file cannot be read, or is not of this kind.
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
    places, radius = {}, 0.0
    for _ in range(nodes):
        name, x, y, z, radius = (float(next(words)) for _ in range(5))
        places[int(name)] = (x, y, z)
    pairs = []
    for _ in range(edges):
        row = [next(words) for _ in range(13)]
        pairs.append((int(row[1]), int(row[2])))
    order = _chain(pairs)
    return np.array([places[name] for name in order]), radius


def _chain(pairs: list[tuple[int, int]]) -> list[int]:
    """The nodes from one end to the other."""
    beside: dict[int, list[int]] = {}
    for a, b in pairs:
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    order = [min(name for name, others in beside.items() if len(others) == 1)]
    while len(order) <= len(pairs):
        order.append(next(name for name in beside[order[-1]] if name not in order[-2:-1]))
    return order


def tubes(path: str | Path, rng: Generator, size: Size) -> Scene | None:
    """The bin from above, without its walls; the camera as far away as it takes to see all of the tubes."""
    studio = make_studio(rng, size, (0.8, 1.1), 8.0)
    color = cable_color(rng)
    found = [(densify(nodes, SPACING), radius) for nodes, radius in read_tubes(path)]
    while not all(studio.inside(axis) for axis, _ in found):
        studio = replace(studio, distance=STEP_BACK * studio.distance)
        if studio.distance > FARTHEST:
            return None
    cables = tuple(Truth(studio.to_camera(axis), radius, color=color) for axis, radius in found)
    return Scene("", "", 0, studio.camera, cables, (), studio.table(), studio.light)
