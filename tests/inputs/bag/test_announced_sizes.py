"""Sizes that bags announce are checked against the bytes at hand before memory is taken."""

from __future__ import annotations

import json
import struct
import subprocess
import sys

import numpy as np
import pytest
from builders.bags import KINDS, BagScript

from doo3d.inputs import open_capture

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="bounds memory, and reads it from /proc")
pytest.importorskip("rosbags")

EXTREMES = (0xFFFFFFFF, 0x7FFFFFFF, 0x40000000)
SPARE_MB = 120
"""Memory in MB that opening and loading may take besides that of an intact bag: the smallest extreme announces 1 GB."""

CHILD = f"""
import json, resource, sys
from pathlib import Path
from doo3d.errors import InputError
from doo3d.inputs import open_capture

def read(path):
    for frame in open_capture(path).frames:
        frame.load()

first, *others = (Path(line) for line in sys.stdin.read().splitlines())
read(first)
pages = int(Path("/proc/self/statm").read_text().split()[0])
resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + ({SPARE_MB} << 20),) * 2)
for path in others:
    try:
        read(path)
        end = ""
    except InputError as error:
        end = error.code + ": " + str(error)
    print(json.dumps([str(path), end]))
"""


def bag_file(folder):
    return folder if folder.is_file() else next(file for file in folder.iterdir() if file.suffix in (".db3", ".mcap"))


def ends_within_memory(intact, hostile):
    """Return path -> error of bags opened and loaded in a process of bounded memory, after an intact one."""
    paths = "\n".join(map(str, [intact, *hostile]))
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", CHILD], input=paths, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    ends = dict(map(json.loads, done.stdout.splitlines()))
    assert set(ends) == set(map(str, hostile))
    assert not [end for end in ends.values() if "memory" in end]
    return ends


def cloud_bag(kind, **fields):
    script = BagScript(kind)
    script.cloud("/points", 10**9, np.ones(50, np.dtype([(axis, "f4") for axis in "xyz"])), height=1)
    for name, value in fields.items():
        object.__setattr__(script.messages[0][3], name, value)
    return script


def image_bag(kind, **fields):
    script = BagScript(kind)
    script.image("/depth", 10**9, np.full((1, 40), 900), "16UC1")
    script.info("/camera_info", (40, 1), (40, 40, 20, 0))
    for name, value in fields.items():
        object.__setattr__(script.messages[0][3], name, value)
    return script


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("make", "names"), [(cloud_bag, ("width", "height", "point_step", "row_step")), (image_bag, ("width", "height", "step"))]
)
def test_numbers_of_a_message(tmp_path, kind, make, names):
    intact = make(kind).write(tmp_path / "intact")
    hostile = [make(kind, **{name: value}).write(tmp_path / f"{name} {value}") for name in names for value in EXTREMES]
    pairs = [("width", "height"), *([("height", "row_step")] if make is cloud_bag else [("height", "step")])]
    hostile += [make(kind, **dict.fromkeys(pair, 0xFFFFFFFF)).write(tmp_path / " ".join(pair)) for pair in pairs]
    ends = ends_within_memory(intact, hostile)
    # the length of a row says nothing about a single one
    assert {path for path, end in ends.items() if not end} <= {str(file) for file in hostile if "step " in file.name}


@pytest.mark.parametrize("kind", KINDS)
def test_lengths_of_lists(tmp_path, kind):
    intact = cloud_bag(kind).write(tmp_path / "intact")
    data = bag_file(intact).read_bytes()
    hostile = []
    for name, mark in (("fields", struct.pack("<I", 3)), ("data", struct.pack("<I", 600) + np.ones(2, "<f4").tobytes())):
        place = data.rindex(mark, 0, data.index(np.ones(4, "<f4").tobytes()) + 8)
        for value in EXTREMES:
            folder = cloud_bag(kind).write(tmp_path / f"{name} {value}")
            bag_file(folder).write_bytes(data[:place] + struct.pack("<I", value) + data[place + 4 :])
            hostile.append(folder)
    assert all(ends_within_memory(intact, hostile).values())


PACKED = [("ros1", None), ("ros1", "bz2"), ("ros1", "lz4"), ("mcap", None), ("mcap", "storage"), ("sqlite3", None)]


@pytest.mark.parametrize(("kind", "packing"), PACKED)
def test_lengths_of_records(tmp_path, kind, packing):
    intact = cloud_bag(kind).write(tmp_path / "intact", packing)
    data = bag_file(intact).read_bytes()
    first = {"ros1": 4117, "mcap": 8, "sqlite3": 8192}[kind]  # ROS 1 pads its first record to 4096 bytes
    message = max(data.rfind(np.ones(4, "<f4").tobytes()) - 800, 0)  # a row of SQLite lies before the end of its page
    places = range(message, message + 120) if kind == "sqlite3" else range(first, first + 120)
    hostile = []
    for place in places:
        for value in (struct.pack("<I", 0x7FFFFFFF), struct.pack(">I", 0x7FFFFFFF)):
            file = tmp_path / f"{place} {value[0]}{bag_file(intact).suffix}"
            file.write_bytes(data[:place] + value + data[place + 4 :])
            hostile.append(file)
    assert any(ends_within_memory(bag_file(intact), hostile).values())


def test_points_that_are_signalling_nans_are_left_out(tmp_path):
    script = BagScript("ros1")
    cells = np.ones(4, np.dtype([(axis, "f4") for axis in "xyz"]))
    cells["y"][2] = np.array(0x7FA00000, "<u4").view("<f4")
    script.cloud("/points", 10**9, cells)
    assert len(open_capture(script.write(tmp_path / "a.bag")).frames[0].load().data.points) == 3
