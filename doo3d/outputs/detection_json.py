"""A detection as JSON, schema doo3d/detection/1."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

from ..errors import InputError, unread_code
from ..types import Cloud, Detection, Frame, Image

# a list that holds neither lists nor objects nor strings, spread over lines
_FLAT_LIST = re.compile(r"\[\n\s+([^\[\]{}\"]*?)\n\s+\]")


def encode(detection: Detection, data: Frame | Cloud | Image) -> bytes:
    """`detection.to_dict()` as JSON, in UTF-8."""
    return dumps(detection.to_dict()).encode("utf-8")


def dumps(value: Any) -> str:
    """JSON with one line per joint, floats in full, and null for NaN and infinity, which JSON does not have."""
    text = json.dumps(finite(value), indent=1, ensure_ascii=False, allow_nan=False)
    return _FLAT_LIST.sub(lambda found: "[" + re.sub(r"\n\s+", " ", found.group(1)) + "]", text) + "\n"


def read_object(path: str | Path, schemas: tuple[str, ...], what: str) -> dict[str, Any]:
    """Return the object in a JSON file of one of the schemas; `what` such a file is, with its article.

    Raises
    ------
    InputError : not there, not JSON, or of none of the schemas.
    """
    try:
        values = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})", code=unread_code(error)) from None
    except ValueError as error:
        raise InputError(f"{path}: is not valid JSON ({error})", code="json-invalid") from None
    if not isinstance(values, dict) or values.get("schema") not in schemas:
        raise InputError(f"{path}: is not {what}: expected an object with schema {schemas[0]!r}", code="schema-unknown")
    return values


def finite(value: Any) -> Any:
    """The same with None for NaN and infinity."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
