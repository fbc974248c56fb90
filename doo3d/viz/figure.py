"""Draw chains as an interactive plotly figure: tubes in space, as in the report, or lines over the image in 2-D."""

import base64
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from ..errors import require
from ..inputs import FrameData
from ..types import Array, Chain, Cloud, Detection, Floats, Frame, Image
from .palette import ChainStyle, all_chains, chain_numbers
from .segment_kinds import KIND_WORDS, SEEN, segment_kinds
from .surroundings import sample_surroundings

TUBE_SIDES = 12
MAX_POINTS = 20_000  # around the chains: more slow a browser down
OPACITY = (1.0, 0.6, 0.3, 0.45)  # by the kind of segment
DASHES = ("solid", "dot", "dash", "longdashdot")  # of the center line, by the kind of segment
QUIET = "rgb(125, 125, 125)"
CAMERA_VIEW = {"up": {"x": 0, "y": -1, "z": 0}, "eye": {"x": 0.25, "y": -0.45, "z": -1.25}}  # from above the camera
WORLD_VIEW = {"up": {"x": 0, "y": 0, "z": 1}, "eye": {"x": 0.85, "y": 0.85, "z": 0.7}}
LIGHT = {"ambient": 0.72, "diffuse": 0.5, "specular": 0.12}


def figure(result: Detection | Chain, data: Frame | Cloud | Image | Array | None = None) -> Any:
    """Return chains as a figure that can be rotated and zoomed, a plotly.graph_objects.Figure.

    Parameters
    ----------
    result
        a detection, or one chain, which is taken to be in the coordinates of `data`.
    data
        the input that the chains were found in, shown around them (in 2-D: below them); None for none.

    Raises
    ------
    MissingDependency : plotly is not installed.
    """
    go = require("plotly.graph_objects")
    detection = result if isinstance(result, Detection) else _alone(result, data)
    drawn = go.Figure()
    joined = {end for junction in detection.junctions for end in junction.ends}
    for index, (chain, style, number) in enumerate(all_chains(detection)):
        name = ", ".join(filter(None, (f"chain {number}" * bool(number), style.doubt)))
        at_junction = (index, 0) in joined
        drawn.add_traces(
            _flat(go, chain, name, style) if detection.mode == "2d" else _tube(go, chain, name, style, number, at_junction)
        )
    drawn.add_traces(_junctions(go, detection))
    drawn.update_layout(margin={"l": 0, "r": 0, "t": 30, "b": 0}, title=detection.frame, legend_itemsizing="constant")
    if detection.mode == "2d":
        _place_on_image(drawn, data)
        return drawn
    drawn.add_traces(_points(go, detection, data))
    view = CAMERA_VIEW if detection.coordinates == "camera" else WORLD_VIEW
    axes = {f"{axis}axis_title": f"{axis} (m)" for axis in "xyz"}
    scene = {"aspectmode": "manual", "aspectratio": _sides(drawn), "camera": view, **axes}
    return drawn.update_layout(scene=scene, height=600)


def _junctions(go: Any, detection: Detection) -> list[Any]:
    """Return the plotly trace of the junctions, white diamonds; empty without junctions."""
    if not detection.junctions:
        return []
    numbers = chain_numbers(detection)
    at = np.array([junction.position for junction in detection.junctions])
    text = [
        f"junction {k} of chains {', '.join(str(numbers[end.chain]) for end in each.ends)}<br>confidence {each.confidence:.2f}"
        for k, each in enumerate(detection.junctions)
    ]
    marker = {"size": 9, "color": "white", "symbol": "diamond", "line": {"color": "black", "width": 2}}
    shared = {"mode": "markers", "marker": marker, "name": "junctions", "hoverinfo": "text", "hovertext": text}
    if detection.mode == "2d":
        return [go.Scatter(x=at[:, 0], y=at[:, 1], **shared)]
    return [go.Scatter3d(x=at[:, 0], y=at[:, 1], z=at[:, 2], **shared)]


def _sides(drawn: Any) -> dict[str, float]:
    """Return the relative sides of the box around all traces; the longest is 1."""
    extents = {}
    for axis in "xyz":
        values = [np.asarray(trace[axis], dtype=float) for trace in drawn.data if len(trace[axis])]
        extents[axis] = float(np.ptp(np.concatenate(values))) if values else 1.0
    longest = max(*extents.values(), 1e-9)
    return {axis: max(extent / longest, 1e-3) for axis, extent in extents.items()}


def _alone(chain: Chain, data: Frame | Cloud | Image | Array | None) -> Detection:
    """Return a detection with a single chain, in the coordinates of the data."""
    mode = f"{chain.joints.shape[1]}d"
    coordinates = "image" if mode == "2d" else data.coordinates if isinstance(data, Cloud) else "camera"
    return Detection((chain,), mode=mode, coordinates=coordinates, frame="")


def _css(style: ChainStyle) -> str:
    return "rgb({}, {}, {})".format(*style.color)


def _runs(chain: Chain) -> Iterator[tuple[int, int, int]]:
    """Yield runs of segments of one kind: first joint, last joint, kind as `segment_kinds` returns it."""
    kind = segment_kinds(chain)
    edges = [0, *(np.flatnonzero(np.diff(kind)) + 1).tolist(), len(kind)]
    for first, last in pairwise(edges):
        yield first, last, int(kind[first])


def _tube(go: Any, chain: Chain, name: str, style: ChainStyle, number: str, at_junction: bool) -> list[Any]:
    """Return the plotly traces of a 3-D chain: tubes, center line, a disc at the first joint and a ring at the last.

    Parameters
    ----------
    go
        plotly.graph_objects.
    chain
        the chain.
    name
        name of the chain, such as "chain 0".
    style
        color of the chain, and the factor of its radius.
    number
        number of the chain as text; empty for a doubtful chain.
    at_junction
        whether the first joint is at a junction; the number is then beside the middle of the chain.
    """
    radius = chain.radius if np.isfinite(chain.radius) else 0.0
    radii = np.where(np.isfinite(chain.radii), chain.radii, radius)
    color = _css(style)
    rings, traces = _rings(chain.joints, style.width * radii), []
    shared = {"name": name, "legendgroup": name}
    for piece, (first, last, kind) in enumerate(_runs(chain)):
        x, y, z = rings[first : last + 1].reshape(-1, 3).T
        i, j, k = _triangles(last - first + 1)
        words = "" if kind == SEEN else f"<br>{KIND_WORDS[kind]}"
        text = [f"{name}, joint {n}<br>radius {1000 * radii[n]:.1f} mm{words}" for n in range(first, last + 1)]
        mesh = {"i": i, "j": j, "k": k, "color": color, "opacity": OPACITY[kind], "lighting": LIGHT}
        hover = {"hoverinfo": "text", "hovertext": np.repeat(text, TUBE_SIDES)}
        traces.append(go.Mesh3d(x=x, y=y, z=z, **mesh, **hover, **shared))
        x, y, z = chain.joints[first : last + 1].T
        line = {"color": color, "width": 4 * style.width, "dash": DASHES[kind]}
        traces.append(go.Scatter3d(x=x, y=y, z=z, mode="lines", line=line, hoverinfo="skip", showlegend=piece == 0, **shared))
    ends = chain.joints[[0] if chain.closed else [0, -1]]
    marker = {
        "size": 8 * style.width,
        "color": color,
        "symbol": ["circle", "circle-open"][: len(ends)],
        "line": {"color": "black", "width": 2},
    }
    x, y, z = ends.T
    hover = {"hoverinfo": "text", "hovertext": [f"{name}, first joint", f"{name}, last joint"][: len(ends)]}
    label = {"text": ["" if at_junction else number, ""][: len(ends)], "textposition": "top center"}
    traces.append(go.Scatter3d(x=x, y=y, z=z, mode="markers+text", marker=marker, showlegend=False, **label, **hover, **shared))
    if at_junction:
        x, y, z = chain.joints[len(chain.joints) // 2][:, None]
        traces.append(go.Scatter3d(x=x, y=y, z=z, mode="text", text=[number], showlegend=False, hoverinfo="skip", **shared))
    return traces


def _rings(joints: Floats, radii: Floats) -> Floats:
    """Return the circles around the joints, (N + 1, TUBE_SIDES, 3) m, parallel-transported along the chain without twist."""
    tangents = np.gradient(joints, axis=0)
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-12)
    side = np.eye(3)[0 if abs(tangents[0, 0]) < 0.8 else 1]
    angle = 2 * np.pi * np.arange(TUBE_SIDES) / TUBE_SIDES
    rings = np.empty((len(joints), TUBE_SIDES, 3))
    for n, tangent in enumerate(tangents):
        side = side - (side @ tangent) * tangent
        side = side / max(float(np.linalg.norm(side)), 1e-12)
        around = np.outer(np.cos(angle), side) + np.outer(np.sin(angle), np.cross(tangent, side))
        rings[n] = joints[n] + radii[n] * around
    return rings


def _triangles(joints: int) -> tuple[Array, Array, Array]:
    """Return the corner indices i, j, k of the triangles between consecutive circles."""
    a = np.arange((joints - 1) * TUBE_SIDES)
    b = a - a % TUBE_SIDES + (a + 1) % TUBE_SIDES
    return np.concatenate((a, b)), np.concatenate((b, b + TUBE_SIDES)), np.concatenate((a + TUBE_SIDES, a + TUBE_SIDES))


def _points(go: Any, detection: Detection, data: Frame | Cloud | Image | Array | None) -> list[Any]:
    """Return the plotly traces of the points around the chains; empty without 3-D data."""
    if not isinstance(data, Frame | Cloud):
        return []
    pose = np.eye(4) if isinstance(data, Cloud) and data.coordinates == detection.coordinates else None
    sample = sample_surroundings(FrameData(data, pose=pose), detection, MAX_POINTS)
    if sample is None:
        return []
    # points of the object are gray, to be distinguished from its chain, and lie on its surface, so they are shown on a click
    parts = (
        ("object's points", slice(0, sample.on_object), None),
        ("surroundings", slice(sample.on_object, None), sample.colors),
    )
    traces = []
    for name, part, colors in parts:
        color = QUIET if colors is None else [f"rgb({r},{g},{b})" for r, g, b in colors[part].tolist()]
        x, y, z = sample.points[part].T
        marker = {"size": 1.5, "color": color, "opacity": 0.5}
        traces.append(go.Scatter3d(x=x, y=y, z=z, mode="markers", marker=marker, hoverinfo="skip", name=name))
    traces[0].visible = "legendonly"
    return traces


def _flat(go: Any, chain: Chain, name: str, style: ChainStyle) -> list[Any]:
    """Return the plotly traces of a 2-D chain, px."""
    traces, color = [], _css(style)
    for piece, (first, last, kind) in enumerate(_runs(replace(chain, depth_filled=np.zeros(0, dtype=bool)))):
        x, y = chain.joints[first : last + 1].T
        line, marker = {"color": color, "width": 3 * style.width, "dash": DASHES[kind]}, {"color": color, "size": 4 * style.width}
        label = {"name": name, "legendgroup": name, "showlegend": piece == 0}
        traces.append(go.Scatter(x=x, y=y, mode="lines+markers", line=line, marker=marker, **label))
    return traces


def _place_on_image(drawn: Any, data: Frame | Cloud | Image | Array | None) -> None:
    """Set up a 2-D figure: y down, one scale for both axes, and the image, if any, behind the chains."""
    drawn.update_yaxes(scaleanchor="x", autorange="reversed")
    image = data.color if isinstance(data, Frame | Image) else data if isinstance(data, np.ndarray) else None
    if image is None:
        return
    from .encoding import encode_image  # cv2 takes long to import

    height, width = image.shape[:2]
    source = "data:image/png;base64," + base64.b64encode(encode_image(image)).decode("ascii")
    place = {
        "x": -0.5,
        "y": -0.5,
        "sizex": width,
        "sizey": height,
        "xref": "x",
        "yref": "y",
        "layer": "below",
        "sizing": "stretch",
    }
    drawn.add_layout_image(source=source, **place)
    drawn.update_xaxes(range=[-0.5, width - 0.5])
    drawn.update_yaxes(autorange=False, range=[height - 0.5, -0.5])
