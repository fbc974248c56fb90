"""A detection as JSON, schema doo3d/detection/2."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..guard.parsing import read_json
from ..types import Cloud, Detection, Frame, Image

# a list of numbers, spread over lines: it holds neither lists nor objects nor strings
_NUMBER_LIST = re.compile(r"\[\n\s+([^\[\]{}\"]*?)\n\s+\]")


def encode(detection: Detection, data: Frame | Cloud | Image | None = None) -> bytes:
    """Return the content of a frame's JSON file (schema doo3d/detection/2) as UTF-8 bytes.

    Parameters
    ----------
    detection
        the chains and crossings to write.
    data
        not used; it is there because all functions that encode a file of a frame take the same two arguments.
    """
    return dumps(detection.to_dict()).encode("utf-8")


def dumps(value: Any) -> str:
    """Return a value as indented JSON text, ending in a newline.

    Floats have full precision, NaN and infinity become null, and a list of numbers, such as a joint, is on one line.
    """
    text = json.dumps(finite(value), indent=1, ensure_ascii=False, allow_nan=False)
    return _NUMBER_LIST.sub(lambda match: "[" + re.sub(r"\n\s+", " ", match.group(1)) + "]", text) + "\n"


def read_object(path: str | Path, schemas: tuple[str, ...], what: str) -> dict[str, Any]:
    """Return the object at the top level of a JSON file as a dict, after checking its key "schema".

    Parameters
    ----------
    path
        the file.
    schemas
        the accepted values of the key "schema", the current one first.
    what
        the kind of file for error messages, with an article, such as "a detection".

    Raises
    ------
    InputError
        the file is missing, is not JSON, or has another schema.
    """
    values = read_json(path)
    if not isinstance(values, dict) or values.get("schema") not in schemas:
        raise InputError(f"{path}: is not {what}: expected an object with schema {schemas[0]!r}", code="schema-unknown")
    return values


def finite(value: Any) -> Any:
    """Return a copy of nested dicts, lists and tuples with NaN and infinity replaced by None; tuples become lists."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
