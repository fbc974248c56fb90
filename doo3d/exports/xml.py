"""Write XML text without recursion, since chains are nested deeper than the standard library's writer allows."""

from collections.abc import Iterable
from typing import Any
from xml.sax.saxutils import escape as _escape

import numpy as np


def escape(text: str) -> str:
    """Return the text with &, <, > and " replaced by XML entities, for an attribute in double quotes."""
    return _escape(text, {'"': "&quot;"})


def numbers(values: Any) -> str:
    """Return a number, or the numbers of a (nested) sequence separated by spaces, as text in full precision."""
    if isinstance(values, Iterable):
        return " ".join(map(numbers, values))
    return repr(float(values)) if isinstance(values, float | np.floating) else str(int(values))


def tag(element: str, close: bool = True, /, **attributes: Any) -> str:
    """Return an XML tag with its attributes as text, such as `<joint name="a" pos="0 0 1"/>`.

    Parameters
    ----------
    element
        name of the element.
    close
        true for an empty element `<element .../>`; false for an opening tag `<element ...>`, which the caller closes with
        `</element>`.
    **attributes
        attributes of the tag; a value is a text, a number, or a sequence of numbers, which are written separated by spaces.
    """
    items = (f'{key}="{escape(value) if isinstance(value, str) else numbers(value)}"' for key, value in attributes.items())
    return f"<{' '.join((element, *items))}{'/' * close}>"
