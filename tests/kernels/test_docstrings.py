"""The comments above the bindings of the kernels are their docstrings."""

from __future__ import annotations

import re
from importlib.util import module_from_spec, spec_from_file_location
from types import ModuleType

import pytest
from builders.paths import ROOT

from doo3d import kernels

SHAPE = re.compile(r"\([A-Z1-9][\w ,+*/.]*,[^)]*\)")
KERNELS = {name: kernel for name, kernel in vars(kernels._native).items() if not name.startswith("_")}
MEMBERS = {
    f"{name}.{member}": vars(kernel)[member]
    for name, kernel in KERNELS.items()
    if isinstance(kernel, type)
    for member in vars(kernel)
    if not member.startswith("_")
}
DOCUMENTED = KERNELS | MEMBERS


def tool(name: str) -> ModuleType:
    """Return a program beside the build backend, which is no part of the package."""
    spec = spec_from_file_location(name, ROOT / "doo3d" / "kernels" / "backend" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_docstrings_are_the_comments_above_the_bindings():
    comments = tool("docstrings").read_docstrings(ROOT / "doo3d" / "kernels" / "src")
    assert comments.pop("") == kernels._native.__doc__
    assert set(comments) == set(DOCUMENTED)
    for name, comment in comments.items():
        assert DOCUMENTED[name].__doc__.endswith(comment), name


def test_the_letters_of_shapes_are_defined_once():
    sources = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "doo3d" / "kernels" / "src").rglob("*.*"))
    assert sources.count("P points of a polyline,") == 1
    assert "P points of a polyline," in kernels._native.__doc__


@pytest.mark.parametrize("name", DOCUMENTED)
def test_arrays_have_a_shape_in_the_docstring(name):
    item = DOCUMENTED[name]
    text = getattr(item, "fget", item).__doc__  # begins with the signature, but for a class
    assert SHAPE.search(text) or not ("ndarray[" in text or isinstance(item, type))


@pytest.mark.parametrize(
    ("source", "error"),
    [
        ('m.def("bare", &bare);', "a.cpp:1: no comment above the binding of 'bare'"),
        ('// One.\nm.def("one", &one);\n// Two.\nm.def("one", &two);', "a.cpp:4: a second binding of 'one'"),
        ('// C.\nClass<C>(m, "C")\n    .def_ro("bare", &C::bare);', "a.cpp:3: no comment above the binding of 'C.bare'"),
    ],
)
def test_a_binding_without_a_comment_of_its_own_is_refused(tmp_path, source, error):
    (tmp_path / "a.cpp").write_text(source)
    with pytest.raises(ValueError, match=re.escape(error)):
        tool("docstrings").read_docstrings(tmp_path)


def test_texts_become_literals_of_one_line_each():
    literal = tool("docstrings").literal('of "a\\b"\n\n    5 µm')
    assert [line.strip() for line in literal.splitlines()] == ['"of \\"a\\\\b\\"\\n"', '"\\n"', '"    5 \\302\\265m"']
