"""Tubes in a bin, read from a text file of straight cylinders.

First line: the number of tubes. Then per tube `id nodes edges`; nodes `id x y z radius`; edges, of which the name
`e_a_b` and the two nodes a and b count. Metres, z up, the bin's floor at z = 0. A tube's nodes are in the order of
its edges, not of the file.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.random import Generator

from ..errors import InputError
from ..types import Floats
from .families import Size
from .laying import SPACING
from .model import Scene, Truth
from .studio import cable_color, make_studio


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
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, StopIteration, RuntimeError) as error:
        raise InputError(f"{path}: is not a tube configuration ({error!r})") from None


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
    """The bin from above, without its walls."""
    studio = make_studio(rng, size, (0.8, 1.1), 8.0)
    color = cable_color(rng)
    cables = []
    for nodes, radius in read_tubes(path):
        along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(nodes, axis=0), axis=1))))
        at = np.linspace(0, along[-1], int(np.ceil(along[-1] / SPACING)) + 1)
        axis = np.column_stack([np.interp(at, along, nodes[:, k]) for k in range(3)])
        if not studio.inside(axis):
            return None
        cables.append(Truth(studio.to_camera(axis), radius, color=color))
    return Scene("", "", 0, studio.camera, tuple(cables), (), studio.table(), studio.light)
