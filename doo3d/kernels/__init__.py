"""Hot loops on plain arrays, native; `__init__.pyi` says what each does, with shapes and units."""

from ._loading import load_native

_native = load_native()
__all__ = sorted(name for name in vars(_native) if not name.startswith("_"))
globals().update({name: getattr(_native, name) for name in __all__})
