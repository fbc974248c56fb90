"""Build backend: scikit-build-core, with zig's C++ compiler from the package index on a machine that has none."""

import os
import shutil
import sys
import tempfile
from pathlib import Path

from scikit_build_core import build
from scikit_build_core.build import build_sdist, get_requires_for_build_sdist  # noqa: F401

VISUAL_STUDIO = Path(os.environ.get("ProgramFiles(x86)", ""), "Microsoft Visual Studio", "Installer", "vswhere.exe")
HAS_COMPILER = "CXX" in os.environ or any(map(shutil.which, ("c++", "g++", "clang++", "cl"))) or VISUAL_STUDIO.is_file()
ZIG = [] if HAS_COMPILER else ["ziglang>=0.13"]
TOOLS = {"CC": "cc -mcpu=baseline", "CXX": "c++ -mcpu=baseline", "AR": "ar", "RANLIB": "ranlib"}
CMAKE = {"CC": "C_COMPILER", "CXX": "CXX_COMPILER", "AR": "AR", "RANLIB": "RANLIB"}
SCRIPT = ("@", "%*", ".bat") if os.name == "nt" else ("#!/bin/sh\nexec ", '"$@"', "")


def get_requires_for_build_wheel(config_settings=None):
    return [*build.get_requires_for_build_wheel(config_settings), *ZIG]


def get_requires_for_build_editable(config_settings=None):
    return [*build.get_requires_for_build_editable(config_settings), *ZIG]


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None, make=build.build_wheel):
    with tempfile.TemporaryDirectory() as folder:
        for name, call in TOOLS.items() if ZIG else ():
            script = Path(folder, f"zig-{name.lower()}{SCRIPT[2]}")
            script.write_text(f'{SCRIPT[0]}"{sys.executable}" -m ziglang {call} {SCRIPT[1]}\n')
            script.chmod(0o755)
            os.environ |= {name: str(script), "CMAKE_ARGS": f"{os.environ.get('CMAKE_ARGS', '')} -DCMAKE_{CMAKE[name]}={script}"}
        return make(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    return build_wheel(wheel_directory, config_settings, metadata_directory, build.build_editable)
