"""Hot loops on plain arrays, native; the comments above their bindings in `src/` are their docstrings."""

from ._loading import load_native

_native = load_native()
__doc__ = _native.__doc__
__all__ = sorted(name for name in vars(_native) if not name.startswith("_"))
globals().update({name: getattr(_native, name) for name in __all__})
