"""Display data: one short line in a prompt, a table and a drawing in a notebook, a figure on request.

Figures are drawn by `viz`, which depends on this package: it registers its functions in `plugins.DRAWING`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

from ..plugins import DRAWING

if TYPE_CHECKING:
    from .tree import LinearObject

Rows = Literal["chains", "doubtful", "joints", "crossings", "junctions"]

DOUBTFUL_CONFIDENCE = 0.5
"""Confidence below which a chain is drawn as doubtful: it is then more likely wrong than right."""

MAX_LISTED_OBJECTS = 3
"""Greatest number of branched objects, and of doubtful chains, that are described one by one."""


class Displayed:
    """Mix-in of data that is displayed in a prompt as one short line, its `summary`."""

    def summary(self) -> str:
        """Return the facts of the data in one short line."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.summary()})"


class Drawn(Displayed):
    """Mix-in of results that draw themselves: as an interactive figure, and as HTML in a notebook."""

    def plot(self, data: Any = None) -> Any:
        """Return an interactive figure: chains as tubes of their own radius, pale and dashed where they are occluded.

        In 2-D the chains are lines, in pixels. White diamonds mark junctions. A notebook shows the figure; `.show()` opens it in
        a browser.

        data : the Frame, Cloud or image that the chains were found in, shown around (in 2-D: below) them; None for none.

        Returns
        -------
        A plotly.graph_objects.Figure, which can be changed, combined and saved like any other.
        """
        return DRAWING["figure"](self, data)

    def _repr_html_(self) -> str:
        """Return a table and a small drawing of the chains, for notebooks."""
        return str(DRAWING["html"](self))


def length_text(length: float, planar: bool) -> str:
    """Return a length as text, such as "1.080 m", or "312 px" if `planar`; length : m (px if planar)."""
    return f"{length:.0f} px" if planar else f"{length:.3f} m"


def radius_text(radius: float, planar: bool) -> str:
    """Return a radius as text, such as "3.9 mm", "4.2 px" if `planar`, or "unknown"; radius : m (px if planar)."""
    if radius != radius:
        return "unknown"
    return f"{radius:.1f} px" if planar else f"{1000 * radius:.1f} mm"


def tree_text(objects: int, chains: int, junctions: int) -> str:
    """Return the size of branched objects as text, such as "1 object, 5 chains, 2 junctions"."""
    return ", ".join((counted(objects, "object"), counted(chains, "chain"), counted(junctions, "junction")))


def objects_text(objects: Sequence[LinearObject]) -> str:
    """Return branched objects as text, such as "2 objects: one with 5 chains and 2 junctions, one without junctions"."""
    if len(objects) == 1:
        return f"1 object with {counted(len(objects[0].chains), 'chain')} and {counted(len(objects[0].junctions), 'junction')}"
    branched = [each for each in objects if each.junctions]
    parts = [
        f"one with {counted(len(each.chains), 'chain')} and {counted(len(each.junctions), 'junction')}"
        for each in branched[:MAX_LISTED_OBJECTS]
    ]
    more, single = len(branched) - len(parts), len(objects) - len(branched)
    parts += [f"{more} more with junctions"] * (more > 0)
    parts += [f"{'one' if single == 1 else single} without junctions"] * (single > 0)
    return f"{counted(len(objects), 'object')}: {', '.join(parts)}" if parts else counted(0, "object")


def doubt_text(confidence: float) -> str:
    """Return the label of a doubtful chain in pictures and tables, such as "doubtful (confidence 0.12)"."""
    return f"doubtful (confidence {math.floor(100 * confidence) / 100:.2f})"


def doubtful_text(chains: Sequence[tuple[float, float]], planar: bool) -> str:
    """Return the doubtful chains of a frame as text, such as "2 doubtful (0.82 m, 0.13; 0.41 m, 0.05)"; empty if none.

    chains : length, m (px if planar), and confidence of each doubtful chain.
    """
    if not chains:
        return ""
    listed = [f"{f'{length:.0f} px' if planar else f'{length:.2f} m'}, {value:.2f}" for length, value in chains]
    more = ["..."] * (len(listed) > MAX_LISTED_OBJECTS)
    return f"{len(chains)} doubtful ({'; '.join([*listed[:MAX_LISTED_OBJECTS], *more])})"


def counted(count: int, noun: str) -> str:
    """Return a number with its noun, such as "1 chain" or "2 chains"."""
    return f"{count} {noun}{'' if count == 1 else 's'}"
