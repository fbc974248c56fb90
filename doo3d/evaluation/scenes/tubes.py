"""Read tubes in a bin from a text file of straight cylinders.

The file begins with the number of tubes. Each tube begins with a line `id nodes edges` (its number, its numbers of nodes and of
edges). A line `id x y z radius` follows for each node, then a line for each edge, of which only the two nodes a and b (after the
name `e_a_b`) are used. Positions are in m, z up, with the bin's floor at z = 0. Only the edges give the order of a tube's nodes.
"""

from collections.abc import Iterator
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


def read_tubes(path: str | Path) -> list[tuple[Floats, float]]:
    """Read a tube configuration, a text file of tubes made of straight cylinders: a list with (nodes, radius) for each tube.

    `nodes` is (K, 3) m, the K points from one end of the tube to the other between which the cylinders run, in the file's frame
    (z up, the bin's floor at z = 0); `radius` is in m.

    Raises
    ------
    InputError : the file cannot be read, or is not a tube configuration.

    Notes
    -----
    The file begins with the number of tubes. Each tube begins with `id nodes edges` (its number, its numbers of nodes and of
    edges), followed by a line `id x y z radius` for each node and a line of 13 words for each edge, of which the second and the
    third are the ids of the two nodes that it joins.
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
    """Order the nodes of a tube from one end to the other, given the pairs that its edges join."""
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
        a tube configuration: a text file of tubes made of straight cylinders, in the format that `read_tubes` reads.
    rng
        the random number generator for the camera and the color.
    size
        (width, height) px of the image.

    Returns
    -------
    The scene in the camera's optical frame; None if the camera would be more than 2.5 m away. Call again with the same `rng` to
    draw another camera.

    Raises
    ------
    InputError : the file cannot be read, or is not a tube configuration.
    """
    drawn = make_studio(rng, size, (0.8, 1.1), 8.0)
    color = cable_color(rng)
    centerlines = [(densify(nodes, AXIS_SPACING), radius) for nodes, radius in read_tubes(path)]
    if (studio := drawn.backed_off([axis for axis, _ in centerlines])) is None:
        return None
    cables = tuple(Truth(studio.to_camera(axis), radius, color=color) for axis, radius in centerlines)
    return studio.scene(cables)
