"""Clouds on which detection has the most work to do: lines, planes, lattices, noise, millions of points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from doo3d.types import Floats

from .worst_cases import SEED


def collinear(count: int) -> Floats:
    """Return points on a straight line, evenly spaced over 1 m, as of one line of a scanner."""
    return np.column_stack((np.linspace(0, 1, count), np.zeros(count), np.ones(count)))


def scattered(count: int, dimensions: int, size: float = 1.0) -> Floats:
    """Return points at random in a cube, or in a square or on a line at the distance of its middle, m."""
    points = np.full((count, 3), size / 2)
    points[:, :dimensions] = np.random.default_rng(SEED).uniform(0, size, (count, dimensions))
    return points


def lattice(side: int, dimensions: int) -> Floats:
    """Return the places of a square or cubic lattice over 0.5 m."""
    axes = [np.linspace(0, 0.5, side)] * dimensions
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dimensions)
    return np.column_stack((points, np.ones((len(points), 3 - dimensions))))


def repeated(count: int, different: int) -> Floats:
    """Return few different points, each many times."""
    return np.tile(scattered(different, 3), (count // different, 1))


def ropes(count: int, number: int, radius: float) -> Floats:
    """Return points on the surface of wavy ropes side by side, each 1 m long."""
    random = np.random.default_rng(SEED)
    along, angle = random.uniform(0, 1, count), random.uniform(0, 2 * np.pi, count)
    rope = random.integers(0, number, count)
    y = 4 * radius * rope + 0.05 * np.sin(6 * along) + radius * np.cos(angle)
    return np.column_stack((along, y, 1 + radius * np.sin(angle)))


def helix(count: int, turns: int) -> Floats:
    """Return points on the surface of a wound rope."""
    random = np.random.default_rng(SEED)
    t, normals = random.uniform(0, 2 * np.pi * turns, count), random.normal(size=(count, 3))
    axis = np.column_stack((0.1 * np.cos(t), 0.1 * np.sin(t), 1 + 0.012 * t / (2 * np.pi)))
    return np.asarray(axis + 0.004 * normals / np.linalg.norm(normals, axis=1, keepdims=True))


CLOUDS: dict[str, Callable[[], Floats]] = {
    "2 points": lambda: collinear(2),
    "100 points on a line": lambda: collinear(100),
    "5,000 points on a line": lambda: collinear(5000),
    "1,000,000 points on a line": lambda: collinear(1_000_000),
    "300 points at random on a line": lambda: scattered(300, 1),
    "10 points at random": lambda: scattered(10, 3),
    "200 points at random": lambda: scattered(200, 3),
    "3,000 points at random": lambda: scattered(3000, 3),
    "3,000 points at random over 20 m": lambda: scattered(3000, 3, 20.0),
    "100,000 points at random": lambda: scattered(100_000, 3),
    "1,000,000 points at random": lambda: scattered(1_000_000, 3),
    "2,000 points at random in a plane": lambda: scattered(2000, 2),
    "1,000,000 points at random in a plane": lambda: scattered(1_000_000, 2),
    "lattice of 100 x 100": lambda: lattice(100, 2),
    "lattice of 1,000 x 1,000": lambda: lattice(1000, 2),
    "lattice of 20 x 20 x 20": lambda: lattice(20, 3),
    "lattice of 100 x 100 x 100": lambda: lattice(100, 3),
    "10 points 100,000 times": lambda: repeated(1_000_000, 10),
    "5,000 points 100 times": lambda: repeated(500_000, 5000),
    "rope of 1,000,000 points": lambda: ropes(1_000_000, 1, 0.01),
    "rope of 5,000,000 points": lambda: ropes(5_000_000, 1, 0.01),
    "50 ropes of 1,000,000 points": lambda: ropes(1_000_000, 50, 0.004),
    "helix of 300,000 points": lambda: helix(300_000, 40),
    "5,000,000 points at random": lambda: scattered(5_000_000, 3),
}
"""Name -> points (N, 3), m."""
