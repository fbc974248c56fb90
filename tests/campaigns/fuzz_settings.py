"""Every number among the settings at its bounds, beyond them, and at the ends of what a float or a whole number holds."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, get_args

sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
from fuzz_seeds import HEIGHT, PINHOLE, WIDTH, points, scene

from doo3d.config import Config
from doo3d.config.section import Section

FLOATS = (5e-324, 1e-300, 1e-8, 1e-3, 1.0, 1e3, 1e6, 2.0**31, 2.0**64, 1e300, math.inf, math.nan, -1.0, 0.0)
WHOLE = (0, 1, 2, 1000, 2**31 - 1, 2**31, 2**32, 2**63, 2**64, 10**400)
BOUNDS = ("ge", "gt", "le", "lt")


def _values(section: type[Section], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the key of each number and a value to give it."""
    for name, field in section.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, Section):
            yield from _values(field.annotation, f"{prefix}{name}.")
            continue
        kinds = {field.annotation, *get_args(field.annotation)}
        if not kinds & {int, float}:
            continue
        found = [bound for each in field.metadata for name in BOUNDS if (bound := getattr(each, name, None)) is not None]
        if float in kinds:
            found += [math.nextafter(bound, end) for bound in found for end in (-math.inf, math.inf)]
        for value in dict.fromkeys((*found, *(WHOLE if int in kinds else FLOATS))):
            yield prefix + name, value


SETTINGS = [(key, value, kind) for key, value in _values(Config) for kind in ("frame", "cloud", "image")]


def one_setting(number: int) -> tuple[str, Callable[[], Any]]:
    """Return what setting `number` is, and a function that detects chains with it."""
    key, value, kind = SETTINGS[number]
    return f"{kind}, {key}={str(value)[:30]}", lambda: _detect(key, value, kind)


def _detect(key: str, value: Any, kind: str) -> None:
    from doo3d import Camera, Cloud, Frame, Image, detect, load_config

    config = load_config("image" if kind == "image" else "default", {key: value})
    color, depth, mask = scene()
    if kind == "image":
        detect(Image(color), config, mask)
    elif kind == "cloud":
        detect(Cloud(points(), viewpoint=np.zeros(3)), config)
    else:
        detect(Frame(color, (depth / 1000).astype(np.float32), Camera(*PINHOLE, WIDTH, HEIGHT)), config, mask)
