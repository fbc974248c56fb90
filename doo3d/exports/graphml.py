"""Export GraphML: chains as the edges of a graph, for NetworkX, igraph, Gephi and yEd."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar

from ..types import Detection
from .base import Export, labels
from .trees import graph_of
from .xml import escape, tag

NODE_KEYS = {"kind": "string", "x": "double", "y": "double", "z": "double"}
EDGE_KEYS = {"chain": "int", "object": "int", "length": "double", "radius": "double", "confidence": "double"}


class GraphMl(Export):
    """Export format GraphML: the junctions and tips of one frame as nodes, its chains as edges.

    Without `merge.branches`, each chain is an edge between two separate tips.
    """

    summary: ClassVar[str] = "graph: junctions and tips with chains between them"
    suffixes: ClassVar[tuple[str, ...]] = (".graphml",)
    supports_2d: ClassVar[bool] = True

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the graph of the frame `frames[0]`.

        Nodes have "kind" ("junction" or "tip") and "x", "y", "z" in m (in 2-D "x", "y" in px). Edges have "chain" (number),
        "object" (index), "length" and "radius" in m (px in 2-D) and "confidence"; an unknown radius is left out.
        """
        path.write_text("\n".join(_lines(frames[0])) + "\n", encoding="utf-8")


def _lines(detection: Detection) -> Iterator[str]:
    graph = graph_of(detection)
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield '<graphml xmlns="http://graphml.graphdrawing.org/xmlns">'
    for kind, keys in (("node", NODE_KEYS), ("edge", EDGE_KEYS)):
        for name, type_name in keys.items():
            yield tag("key", **{"id": f"{kind}_{name}", "for": kind, "attr.name": name, "attr.type": type_name})
    yield f'<graph id="{escape(detection.frame)}" edgedefault="undirected">'
    for number, (position, is_junction) in enumerate(zip(graph.positions.tolist(), graph.junction.tolist(), strict=True)):
        values = {"kind": "junction" if is_junction else "tip", **dict(zip("xyz", map(repr, position), strict=False))}
        yield f'<node id="n{number}">{_data("node", values)}</node>'
    for number, (label, chain) in enumerate(zip(labels(detection), detection.chains, strict=True)):
        first, last = graph.edges[number].tolist()
        values = {
            "chain": str(label),
            "object": str(int(graph.objects[number])),
            "length": repr(float(chain.length)),
            **({"radius": repr(float(chain.radius))} if chain.radius > 0 else {}),
            "confidence": repr(float(chain.confidence)),
        }
        yield f'<edge id="e{number}" source="n{first}" target="n{last}">{_data("edge", values)}</edge>'
    yield "</graph>"
    yield "</graphml>"


def _data(kind: str, values: dict[str, str]) -> str:
    return "".join(f'<data key="{kind}_{name}">{value}</data>' for name, value in values.items())
