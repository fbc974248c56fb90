"""Hot loops on plain arrays, native; the comments above their bindings in `src/` are their docstrings."""

from ._loading import load_native

load_native()

from ._native import *  # noqa: E402, F403
