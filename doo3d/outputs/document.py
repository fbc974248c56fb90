"""A detection as JSON, schema doo3d/detection/1."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

from ..types import Cloud, Detection, Frame, Image
from .atomic import write_text

# a list that holds neither lists nor objects nor strings, spread over lines
_FLAT_LIST = re.compile(r"\[\n\s+([^\[\]{}\"]*?)\n\s+\]")


def write(path: Path, detection: Detection, data: Frame | Cloud | Image) -> None:
    """Write `detection.to_dict()` to `path`."""
    write_text(path, dumps(detection.to_dict()))


def dumps(value: Any) -> str:
    """JSON with one line per joint, floats in full, and null for NaN and infinity, which JSON does not have."""
    text = json.dumps(_finite(value), indent=1, ensure_ascii=False, allow_nan=False)
    return _FLAT_LIST.sub(lambda found: "[" + re.sub(r"\n\s+", " ", found.group(1)) + "]", text) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
