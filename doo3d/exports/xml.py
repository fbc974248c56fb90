"""XML text; a chain nests deeper than the recursion of the standard library's writer allows."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
from xml.sax.saxutils import escape as _escape

import numpy as np


def escape(text: str) -> str:
    """Escape text for an attribute in double quotes."""
    return _escape(text, {'"': "&quot;"})


def numbers(values: Any) -> str:
    """Return a number, or a sequence of them, in full precision."""
    if isinstance(values, Iterable):
        return " ".join(map(numbers, values))
    return repr(float(values)) if isinstance(values, float | np.floating) else str(int(values))


def tag(element: str, close: bool = True, /, **attributes: Any) -> str:
    """Return the tag `<element key="value"/>`, or without the slash if `close` is False."""
    items = (f'{key}="{escape(value) if isinstance(value, str) else numbers(value)}"' for key, value in attributes.items())
    return f"<{' '.join((element, *items))}{'/' * close}>"
