"""Makes the stub of the kernels, for type checkers and editors, from their built module.

    python stub.py _native.so _native.pyi

Arguments are arrays of a kind of numbers, such as `Floats`, whose data type the docstring tells; results are arrays of a data
type, such as `NDArray[numpy.float64]`.
"""

import re
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from nanobind.stubgen import StubGen

KINDS = {"bool_": "Bools", "float32": "Floats", "float64": "Floats", "int32": "Ints", "int64": "Ints", "uint8": "Array"}
ARRAY = re.compile(r"Annotated\[(NDArray\[numpy\.(\w+)\]), dict\(shape=\([^)]*\)([^)]*)\)\]")
IMPORTS = "from numpy.typing import NDArray\n"

spec = spec_from_file_location("_native", sys.argv[1])
native = module_from_spec(spec)
spec.loader.exec_module(native)
made = StubGen(module=native)
made.put(native)
text = ARRAY.sub(lambda array: KINDS[array[2]] if "device" in array[3] else array[1], made.get())
text = text.replace(IMPORTS, f"{IMPORTS}\nfrom ..types import {', '.join(sorted(set(KINDS.values())))}\n", 1)
Path(sys.argv[2]).write_text(text, encoding="utf-8")
