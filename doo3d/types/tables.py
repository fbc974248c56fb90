"""Convert results to tables: name of the column -> list of values, an input of pandas.DataFrame.

The functions accept any object with the attributes of a detection, so that `results` can import this module.
"""

from collections.abc import Sequence
from typing import Any

Table = dict[str, list[Any]]

_OF_FORMULAS = ("=", "+", "-", "@", "\t", "\r")  # first letters: owasp.org/www-community/attacks/CSV_Injection
DEVIATIONS = ("deviation_across", "deviation_along")
"""Columns of the standard deviations of a joint."""


def chains_table(detection: Any) -> Table:
    """Return a table with one row per chain of a detection; see `Detection.table` for the columns."""
    return _table_of(detection, detection.chains, [_object_of(detection, chain) for chain in range(len(detection.chains))])


def doubtful_table(detection: Any) -> Table:
    """Return a table with one row per doubtful chain of a detection, in the columns of `chains_table`."""
    return _table_of(detection, detection.doubtful, [None] * len(detection.doubtful))


def _table_of(detection: Any, chains: Sequence[Any], objects: list[int | None]) -> Table:
    return _framed(
        detection,
        {
            "chain": list(range(len(chains))),
            "id": [chain.id for chain in chains],
            "closed": [chain.closed for chain in chains],
            "segments": [len(chain.occluded) for chain in chains],
            "segment_length": [float(chain.segment_length) for chain in chains],
            "length": [float(chain.length) for chain in chains],
            "radius": [float(chain.radius) for chain in chains],
            "occluded": [float(chain.occluded.mean()) for chain in chains],
            "depth_filled": [float(chain.depth_filled.mean()) for chain in chains],
            "confidence": [float(chain.confidence) for chain in chains],
            **({"object": objects} if detection.objects else {}),
        },
    )


def joints_table(detection: Any) -> Table:
    """Return a table with one row per joint of every chain of a detection; see `Detection.table` for the columns."""
    numbered = list(enumerate(detection.chains))
    per_joint = [(number, chain) for number, chain in numbered for _ in range(len(chain.joints))]
    joints = [joint for _, chain in numbered for joint in chain.joints.tolist()]
    columns: Table = {
        "chain": [number for number, _ in per_joint],
        "id": [chain.id for _, chain in per_joint],
        "closed": [chain.closed for _, chain in per_joint],
        "segment_length": [float(chain.segment_length) for _, chain in per_joint],
        "chain_radius": [float(chain.radius) for _, chain in per_joint],
        "joint": [joint for _, chain in numbered for joint in range(len(chain.joints))],
        **{axis: [joint[k] for joint in joints] for k, axis in enumerate(_axes(detection))},
        "radius": [radius for _, chain in numbered for radius in chain.radii.tolist()],
        "occluded": [value for _, chain in numbered for value in (*chain.occluded.tolist(), None)],
    }
    if detection.mode == "3d":
        columns["depth"] = [word for _, chain in numbered for word in (*chain.depth, None)]
    columns["from_time"] = [value for _, chain in numbered for value in (*chain.from_time.tolist(), None)]
    if detection.mode == "3d":
        for k, name in enumerate(DEVIATIONS):
            columns[name] = [value for _, chain in numbered for value in _deviations(chain, k)]
    return _framed(detection, columns)


def crossings_table(detection: Any) -> Table:
    """Return a table with one row per crossing of a detection; see `Detection.table` for the columns."""
    crossings = detection.crossings
    return _framed(
        detection,
        {
            "upper_chain": [each.upper.chain for each in crossings],
            "upper_segment": [each.upper.segment for each in crossings],
            "lower_chain": [each.lower.chain for each in crossings],
            "lower_segment": [each.lower.segment for each in crossings],
            **{axis: [float(each.point[k]) for each in crossings] for k, axis in enumerate(_axes(detection))},
            "confidence": [float(each.confidence) for each in crossings],
        },
    )


def junctions_table(detection: Any) -> Table:
    """Return a table with one row per chain end that meets at a junction; see `Detection.table` for the columns."""
    rows = [
        (number, junction, end, radius)
        for number, junction in enumerate(detection.junctions)
        for end, radius in zip(junction.ends, junction.radii.tolist(), strict=True)
    ]
    return _framed(
        detection,
        {
            "junction": [number for number, *_ in rows],
            "object": [_object_of(detection, end.chain) for _, _, end, _ in rows],
            "chain": [end.chain for _, _, end, _ in rows],
            "end": [end.end for _, _, end, _ in rows],
            "radius": [radius for *_, radius in rows],
            **{axis: [float(junction.position[k]) for _, junction, _, _ in rows] for k, axis in enumerate(_axes(detection))},
            "confidence": [float(junction.confidence) for _, junction, _, _ in rows],
        },
    )


TABLES = {
    "chains": chains_table,
    "doubtful": doubtful_table,
    "joints": joints_table,
    "crossings": crossings_table,
    "junctions": junctions_table,
}
"""Content of a row, as for `Detection.table` -> the function that makes the table."""


def _deviations(chain: Any, k: int) -> list[float | None]:
    return [None] * len(chain.joints) if chain.deviations is None else chain.deviations[:, k].tolist()


def _object_of(detection: Any, chain: int) -> int | None:
    """Return the index of the object that a chain belongs to; None if no object has it."""
    return next((number for number, each in enumerate(detection.objects) if chain in each.chains), None)


def _axes(detection: Any) -> str:
    return "xy" if detection.mode == "2d" else "xyz"


def _framed(detection: Any, columns: Table) -> Table:
    """Return a table with the frame's name and time as first columns, so that tables of several frames can be concatenated."""
    count = len(next(iter(columns.values())))
    stamp = None if detection.timestamp is None else float(detection.timestamp)
    return {"frame": [detection.frame] * count, "timestamp": [stamp] * count, **columns}


def cell(value: Any) -> Any:
    """Return a value for a table file; a text that a spreadsheet would run as a formula gets an apostrophe in front."""
    return f"'{value}" if isinstance(value, str) and value.startswith(_OF_FORMULAS) else value
