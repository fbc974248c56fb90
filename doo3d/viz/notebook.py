"""Draw chains as HTML for notebooks: a small drawing and a table, without scripts or network access."""

import html
from itertools import pairwise

import numpy as np

from ..geometry.projection import spread_axes
from ..types import Chain, Detection, Floats
from ..types.display import counted, doubtful_text, length_text, objects_text, radius_text
from .palette import all_chains

SIZE, MARGIN = (360.0, 220.0), 16.0  # px of the drawing
HEADER = ("chain", "segments", "length", "radius", "occluded", "confidence")


def html_of(result: Detection | Chain) -> str:
    """Return a detection, or one chain, as an element of HTML: a drawing of the chains with their numbers, and a table.

    The drawing is the camera's view. If the chains are not in the camera's frame, it is the view in which they are most spread
    out.
    """
    if isinstance(result, Chain):
        result = Detection((result,), mode=f"{result.joints.shape[1]}d", frame="chain")
    notes = "".join(f"<li>{html.escape(note)}</li>" for note in result.notes)
    crossings = f", {counted(len(result.crossings), 'crossing')}" if result.crossings else ""
    found = objects_text(result.objects) if result.objects else counted(len(result.chains), "chain")
    doubtful = doubtful_text([(chain.length, chain.confidence) for chain in result.doubtful], result.mode == "2d")
    confidence = "" if result.confidence is None else f", confidence {result.confidence:.2f}"
    title = f"{html.escape(result.frame)}: {found}{crossings}{f', {doubtful}' if doubtful else ''}{confidence}"
    return (
        f'<div class="doo3d"><p><b>{title}</b></p>{_drawing(result)}{_table(result)}{f"<ul>{notes}</ul>" if notes else ""}</div>'
    )


def _table(detection: Detection) -> str:
    if not detection.chains and not detection.doubtful:
        return ""
    planar, rows = detection.mode == "2d", []
    for chain, style, number in all_chains(detection):
        cells = (
            f'<span style="color:{style.css}">&#9679;</span> {number}{" (ring)" if chain.closed else ""}',
            str(len(chain.occluded)),
            length_text(chain.length, planar),
            radius_text(chain.radius, planar),
            f"{chain.occluded.mean():.0%}",
            style.doubt or f"{chain.confidence:.2f}",
        )
        rows.append(f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>")
    head = "".join(f"<th>{name}</th>" for name in HEADER)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def _drawing(detection: Detection) -> str:
    """Return the chains as SVG: a disc marks the first joint of each, the number stands beside it.

    Occluded segments are dashed, with dots between the dashes where other frames filled them in. A white diamond marks a
    junction.
    """
    if not detection.chains and not detection.doubtful:
        return ""
    placed, nodes = _placed(detection)
    shapes = []
    joined = {end for junction in detection.junctions for end in junction.ends}
    for index, ((chain, style, number), points) in enumerate(zip(all_chains(detection), placed, strict=True)):
        color, width = style.css, 3 * style.width
        edges = [0, *(np.flatnonzero(np.diff(chain.occluded.astype(int) + chain.from_time)) + 1).tolist(), len(chain.occluded)]
        for first, last in pairwise(edges):
            path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points[first : last + 1])
            pattern = "8 3 2 3" if chain.from_time[first] else "3 3"
            dash = f' stroke-dasharray="{pattern}"' if chain.occluded[first] else ""
            shapes.append(f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="{width:g}"{dash}/>')
        x, y = points[0]
        shapes.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{color}" stroke="#222"/>')
        x, y = points[len(points) // 2] if (index, 0) in joined else (x, y)
        shapes.append(f'<text x="{x + 7:.1f}" y="{y - 5:.1f}" font-size="12" fill="currentColor">{number}</text>')
    for x, y in nodes:
        square = f'x="{x - 5:.1f}" y="{y - 5:.1f}" width="10" height="10" transform="rotate(45 {x:.1f} {y:.1f})"'
        shapes.append(f'<rect {square} fill="#fff" stroke="#222"><title>junction</title></rect>')
    width, height = SIZE
    return f'<svg width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.0f} {height:.0f}">{"".join(shapes)}</svg>'


def _placed(detection: Detection) -> tuple[list[Floats], Floats]:
    """Return the joints of each chain, (N + 1, 2), and the junctions, (J, 2), px of the drawing."""
    chains = (*detection.chains, *detection.doubtful)
    nodes = [junction.position[None] for junction in detection.junctions]
    joints = np.concatenate([*(chain.joints for chain in chains), *nodes])
    if joints.shape[1] == 3:
        in_view = detection.coordinates == "camera" and bool((joints[:, 2] > 0).all())
        joints = (
            joints[:, :2] / joints[:, 2:]
            if in_view
            else (joints - joints.mean(axis=0)) @ spread_axes(joints - joints.mean(axis=0))[:2].T
        )
    low, high = joints.min(axis=0), joints.max(axis=0)
    scale = float(np.min((np.array(SIZE) - 2 * MARGIN) / np.maximum(high - low, 1e-9)))
    placed = np.array(SIZE) / 2 + scale * (joints - (low + high) / 2)
    *lines, nodes_placed = np.split(placed, np.cumsum([len(chain.joints) for chain in chains]))
    return lines, nodes_placed
