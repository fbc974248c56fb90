"""Arguments that no function expects: of every type and shape that a program may pass by mistake."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

HUGE = 10**400  # more than a float holds


def hostile_values() -> dict[str, Any]:
    """Return name -> value, made anew, since a generator can be used once."""
    return {
        "None": None,
        "text": "text",
        "empty text": "",
        "long text": "x" * 5000,
        "text with zero": "a\0b",
        "number as text": "0.5",
        "bytes": b"\xff\xfe",
        "path": Path("missing") / "file",
        "list": [1, 2, 3],
        "empty list": [],
        "ragged list": [[1, 2], [3]],
        "list of None": [None],
        "list of texts": ["a", "b"],
        "list of objects": [object()],
        "tuple": (0.5,),
        "dict": {"a": 1},
        "dict of numbers": {1: 2},
        "set": {1, 2},
        "true": True,
        "zero": 0,
        "minus one": -1,
        "half": 0.5,
        "huge": HUGE,
        "minus huge": -HUGE,
        "large": 1e300,
        "nan": float("nan"),
        "inf": float("inf"),
        "minus inf": -np.inf,
        "complex": 1j,
        "object": object(),
        "type": int,
        "function": len,
        "module": np,
        "generator": (i for i in range(3)),
        "float16": np.float16(0.5),
        "datetime": np.datetime64("2024-01-01T00:00:00"),
        "no time": np.datetime64("NaT"),
        "timedelta": np.timedelta64(5, "s"),
        "number array": np.array(3.0),
        "empty array": np.zeros(0),
        "no rows": np.zeros((0, 3)),
        "vector": np.zeros(3),
        "vector of nan": np.full(3, np.nan),
        "square": np.zeros((4, 4)),
        "identity": np.eye(4),
        "points": np.arange(12.0).reshape(4, 3),
        "points of nan": np.full((4, 3), np.nan),
        "points of inf": np.full((4, 3), np.inf),
        "image": np.zeros((4, 4, 3), np.uint8),
        "float image": np.ones((4, 4, 3)),
        "mask": np.ones((4, 4), bool),
        "many axes": np.zeros((1,) * 20),
        "complex array": np.ones((4, 4), complex),
        "object array": np.array([[object()] * 4] * 4),
        "array of huge": np.array([HUGE, 1], object),
        "text array": np.array([["a", "b"]] * 2),
        "time array": np.zeros((4, 4), "datetime64[s]"),
        "records": np.zeros(4, [("x", float), ("y", float)]),
        "masked array": np.ma.masked_array(np.ones((4, 4)), np.eye(4)),
        "matrix of fortran": np.asfortranarray(np.ones((4, 4), np.float32)),
        "reversed": np.ones((4, 4), np.float32)[::-1, ::-1],
        "big endian": np.ones((4, 4), ">f4"),
        "broadcast": np.broadcast_to(np.float32(0.5), (10**6, 10**6)),
        "broadcast image": np.broadcast_to(np.uint8(9), (10**6, 10**6, 3)),
        "broadcast points": np.broadcast_to(0.5, (10**12, 3)),
        "broadcast mask": np.broadcast_to(True, (10**6, 10**6)),
        "broadcast line": np.broadcast_to(0.5, (10**12,)),
    }
