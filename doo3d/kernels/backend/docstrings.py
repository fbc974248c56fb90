"""Makes a C++ table of docstrings from the comments above the bindings of the kernels, and the digest of their sources.

    python docstrings.py TABLE.cpp

The docstring of a function, a class, a method or a property is the comment immediately above its binding: `m.def("name", ...)`,
`Class<...>(m, "Name")`, or `.def...("name", ...)` of a class. That of the module is the comment above `NB_MODULE` and the one at
the head of `arrays.h`, which defines the letters of shapes. `documented.h` passes them to nanobind. By the digest
`_loading.py` tells whether the built module is that of the sources.
"""

import re
import sys
from hashlib import sha256
from pathlib import Path

SOURCES = Path(__file__).resolve().parents[1] / "src"
BINDING = re.compile(r'\s*(?:NB_MODULE\(|m\.def\("(?P<name>\w+)"|Class<\w+>\(m, "(?P<type>\w+)"|\.def\w*\("(?P<member>\w+)")')
TABLE = """// Made by docstrings.py of the comments in the sources.
#include <string>
#include <unordered_map>

const char* sources_digest() {{ return "{digest}"; }}

const char* docstring(const std::string& name) {{
    static const std::unordered_map<std::string, const char*> docstrings{{
{rows}
    }};
    return docstrings.at(name);
}}
"""


def comment_above(lines: list[str], index: int) -> str:
    """Return the comment that ends above a line, or "" without one."""
    first = index
    while first > 0 and lines[first - 1].lstrip().startswith("//"):
        first -= 1
    return "\n".join(line.strip()[2:].removeprefix(" ") for line in lines[first:index])


def read_docstrings(sources: Path = SOURCES) -> dict[str, str]:
    """Return the docstring of each name that is bound, such as `Class.method`, and with the name "" that of the module.

    Raises
    ------
    ValueError : a binding has no comment, or a name is bound twice.
    """
    found: dict[str, str] = {}
    for path in sorted(sources.rglob("*.cpp")):
        lines, owner = path.read_text(encoding="utf-8").splitlines(), ""
        for index, line in enumerate(lines):
            if not (binding := BINDING.match(line)):
                continue
            owner = owner if binding["member"] else binding["type"] or ""
            name = f"{owner}.{binding['member']}" if binding["member"] else owner or binding["name"] or ""
            text = comment_above(lines, index)
            if not text or name in found:
                raise ValueError(f"{path}:{index + 1}: {'a second' if text else 'no comment above the'} binding of {name!r}")
            found[name] = text
    head = (sources / "arrays.h").read_text(encoding="utf-8").splitlines()
    found[""] += "\n\n" + comment_above(head, head.index("#pragma once"))
    return found


def literal(text: str) -> str:
    """Return C++ string literals of a text, one a line, since compilers limit the length of each."""
    escaped = {'"': '\\"', "\\": "\\\\", "\n": "\\n"}
    lines = [
        "".join(escaped.get(chr(byte), chr(byte) if 32 <= byte < 127 else f"\\{byte:03o}") for byte in line.encode())
        for line in text.splitlines(keepends=True)
    ]
    return "\n".join(f'         "{line}"' for line in lines).lstrip()


if __name__ == "__main__":
    rows = "\n".join(f'        {{"{name}",\n         {literal(text)}}},' for name, text in read_docstrings().items())
    digest = sha256(b"".join(path.read_bytes() for path in sorted(SOURCES.rglob("*.*")))).hexdigest()
    Path(sys.argv[1]).write_text(TABLE.format(digest=digest, rows=rows), encoding="utf-8")
