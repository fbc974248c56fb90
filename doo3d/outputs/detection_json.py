"""Encode a detection as JSON, schema doo3d/detection/2."""

import json
import math
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..guard.parsing import read_json
from ..types import Cloud, Detection, Frame, Image

_ENCODER = json.JSONEncoder(ensure_ascii=False, allow_nan=False)


def encode(detection: Detection, data: Frame | Cloud | Image | None = None) -> bytes:
    """Return the content of a frame's JSON file (schema doo3d/detection/2) as UTF-8 bytes.

    Parameters
    ----------
    detection
        the chains and crossings to write.
    data
        not used; all encoders of a frame's files take the same two arguments.
    """
    return dumps(detection.to_dict()).encode("utf-8")


def dumps(value: Any) -> str:
    """Return a value as indented JSON text, ending in a newline.

    Floats have full precision, NaN and infinity become null, and a list of numbers, such as a joint, is on one line.
    """
    return _text(value, "\n") + "\n"


def _text(value: Any, newline: str) -> str:
    """Return a value as JSON text; `newline` is the line break with the indentation of its last line.

    Lists of numbers, and lists of these, are encoded by the json module, for speed.
    """
    inside = newline + " "
    if isinstance(value, dict) and value:
        return "{" + ",".join(f"{inside}{_key(key)}: {_text(item, inside)}" for key, item in value.items()) + newline + "}"
    if isinstance(value, list | tuple) and any(isinstance(item, str | dict | list | tuple) for item in value):
        if all(isinstance(item, list | tuple) for item in value):
            text = _on_one_line(value)
            if text.count("[") == 1 + len(value) and '"' not in text and "{" not in text:
                return f"[{inside}{text[1:-1].replace('], [', f'],{inside}[')}{newline}]"
        return "[" + ",".join(inside + _text(item, inside) for item in value) + newline + "]"
    return _on_one_line(value)


def _on_one_line(value: Any) -> str:
    try:
        return _ENCODER.encode(value)
    except ValueError:
        return _ENCODER.encode(finite(value))


def _key(key: Any) -> str:
    """Return a key of a dict as a JSON string."""
    return _ENCODER.encode(key if isinstance(key, str) else _ENCODER.encode(key))


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
