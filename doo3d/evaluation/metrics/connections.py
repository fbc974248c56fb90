"""Count connections and merges, and the wrong ones."""

from __future__ import annotations

from typing import Any

from .merges import wrong_merges
from .observed import Observed
from .record import Metric, added, amount, parts, share


def measure(match: Observed) -> dict[str, Any]:
    """Return the numbers of connections and merges, and of the wrong ones.

    A connection is a pair of successive joints on cables; it is wrong where the chain jumps or turns back. A merge is a place
    where the detection joined two pieces to one chain.
    """
    both = zip(match.chains, match.alignments, strict=True)
    return {
        "merges": sum(len(chain.connections) for chain in match.chains),
        "merges_wrong": sum(wrong_merges(chain, alignment) for chain, alignment in both),
        "connections": sum(alignment.connections for alignment in match.alignments),
        "connections_wrong": sum(alignment.wrong for alignment in match.alignments),
    }


CONNECTIONS = parts("connections", wrong="connections_wrong")
METRIC = Metric(
    measure,
    (
        share(("merges", "correct"), 15, "merges", parts("merges", wrong="merges_wrong")),
        share(("connections", "correct"), 20, "connections", CONNECTIONS, "{}/{} {:.2f} %"),
        amount(("", "wrong"), 6, "connections_wrong", added("connections_wrong")),
    ),
)
