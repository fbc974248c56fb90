"""Every argument of every public function and class with values of any kind: a result, or an error of doo3d."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.drawn_masks import frame_of, wave
from builders.hostile_values import hostile_values

import doo3d
from doo3d.errors import DooError
from doo3d.inputs import Capture, FrameData, FrameRef, ReadOptions
from doo3d.types import ChainEnd, Connection, Crossing, Junction, LinearObject, Plane, SegmentRef, View, as_pose

COLOR, DEPTH = np.zeros((4, 4, 3), np.uint8), np.full((4, 4), 0.5, np.float32)
CAMERA = {"fx": 9.0, "fy": 9.0, "cx": 2.0, "cy": 2.0, "width": 4, "height": 4}
JOINTS = np.column_stack((np.arange(5) * 0.01, np.zeros(5), np.full(5, 0.5)))
FRAME = doo3d.Frame(COLOR, DEPTH, doo3d.Camera(**CAMERA))
CLOUD = doo3d.Cloud(np.random.default_rng(0).random((50, 3)))
CHAIN = doo3d.Chain(JOINTS, 0.01, 0.004)
DETECTION = doo3d.Detection((CHAIN,), pose=np.eye(4))
ROPE, MASK = frame_of(wave(), camera=doo3d.Camera(450.0, 450.0, 160.0, 120.0, 320, 240))
FOUND = doo3d.detect(ROPE, {"merge.chains": 1}, MASK)


def capture() -> Capture:
    loaded = FrameData(FRAME, pose=np.eye(4))

    class Memory:
        path, format, frames = Path("memory"), "memory", [FrameRef(f"{i}", Path("memory"), lambda: loaded) for i in range(1)]

    return Capture.of(Memory())


# function or class -> arguments that work, by name; each is replaced in turn
CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "Camera": (doo3d.Camera, CAMERA),
    "Camera.project": (FRAME.camera.project, {"points": JOINTS}),
    "Camera.unproject": (FRAME.camera.unproject, {"pixels": JOINTS[:, :2], "depth": JOINTS[:, 2]}),
    "Frame": (doo3d.Frame, {"color": COLOR, "depth": DEPTH, "camera": FRAME.camera, "name": "a", "timestamp": 1.0}),
    "Image": (doo3d.Image, {"color": COLOR, "name": "a", "timestamp": 1.0}),
    "Cloud": (
        doo3d.Cloud,
        {
            "points": JOINTS, "colors": np.zeros((5, 3), np.uint8), "viewpoint": np.zeros(3), "name": "a", "timestamp": 1.0,
            "views": (), "segmented": False, "coordinates": "cloud", "notes": (),
        },
    ),
    "Chain": (
        doo3d.Chain,
        {
            "joints": JOINTS, "segment_length": 0.01, "radius": 0.004, "radii": np.full(5, 0.004), "occluded": np.zeros(4, bool),
            "depth_filled": np.zeros(4, bool), "from_time": np.zeros(4, bool), "closed": False,
            "connections": (Connection(1, 0.5),), "id": 0, "confidence": 0.5, "deviations": np.ones((5, 2)),
        },
    ),
    "Chain.nodes": (CHAIN.nodes, {"count": 3}),
    "Chain.plot": (CHAIN.plot, {"data": None}),
    "Detection": (
        doo3d.Detection,
        {
            "chains": (CHAIN,), "mode": "3d", "coordinates": "camera", "frame": "a", "timestamp": 1.0, "seconds": {"fit": 0.1},
            "notes": ("a",), "crossings": (Crossing(SegmentRef(0, 0), SegmentRef(0, 2), JOINTS[1]),),
            "plane": Plane(JOINTS[1], 0.1), "pose": np.eye(4), "junctions": (Junction(JOINTS[0], (ChainEnd(0, 0),), np.ones(1)),),
            "objects": (LinearObject((0,)),), "doubtful": (CHAIN,), "view": View.of(MASK, MASK.shape),
        },
    ),
    "Detection.table": (DETECTION.table, {"rows": "chains"}),
    "Detection.confident": (DETECTION.confident, {"min_confidence": 0.5}),
    "Detection.visibility": (DETECTION.visibility, {"chain": 0}),
    "Detection.transformed": (DETECTION.transformed, {"pose": np.eye(4)}),
    "Detection.plot": (DETECTION.plot, {"data": FRAME}),
    "Config": (doo3d.Config, {"mode": "auto", "seed": 0, "merge": {}, "unknown": None}),
    "ReadOptions": (ReadOptions, {"tolerance": 0.1, "camera": None, "depth_scale": None, "trajectory": None, "pose": None}),
    "load_config": (doo3d.load_config, {"name": "default", "overrides": {"merge.chains": 1}}),
    "detect": (
        doo3d.detect,
        {"data": ROPE, "config": None, "mask": MASK, "pose": np.eye(4), "points": [(5, 5, False)], "box": (0, 0, 99, 99)},
    ),
    "detect in a cloud": (doo3d.detect, {"data": CLOUD, "config": None, "mask": np.ones(50, bool)}),
    "detect in an image": (doo3d.detect, {"data": COLOR, "config": "image", "mask": np.eye(4, dtype=bool)}),
    "explain": (doo3d.explain, {"data": ROPE, "config": None, "mask": MASK}),
    "draw": (doo3d.draw, {"data": ROPE, "detection": FOUND}),
    "detect_sequence": (doo3d.detect_sequence, {"frames": [ROPE], "config": None, "masks": [MASK], "poses": [np.eye(4)]}),
    "fuse": (doo3d.fuse, {"frames": capture(), "config": None}),
    "Detector": (doo3d.Detector, {"config": None, "pose": None}),
    "Detector.update": (lambda **given: doo3d.Detector().update(**given), {"data": ROPE, "mask": MASK, "pose": None}),
    "Tracker": (doo3d.Tracker, {"config": None, "state": None}),
    "Tracker.update": (lambda **given: doo3d.Tracker().update(**given), {"detection": DETECTION}),
    "Tracker.resumed": (doo3d.Tracker.resumed, {"documents": [DETECTION.to_dict()], "config": None}),
    "export": (
        doo3d.export, {"results": DETECTION, "to": "csv", "path": "a.csv", "frames": None, "pose": None, "force": True, "x": 1,
         "min_confidence": 0.5}
    ),
    "to_newton": (doo3d.to_newton, {"builder": None, "detection": DETECTION, "bending": 1e-3}),
    "export with options": (doo3d.export, {"results": DETECTION, "to": "nodes", "path": "nodes", "force": True, "count": 5}),
    "open_capture": (
        doo3d.open_capture, {"path": "x", "images_only": False, "masks": None, "options": ReadOptions(), "camera": None}
    ),
    "open_rig": (
        doo3d.open_rig, {"path": "x", "cameras": "rig.yaml", "config": None, "masks": None, "options": ReadOptions()}
    ),
    "capture": (capture().__getitem__, {"key": 0}),
    "in capture": (capture().__contains__, {"frame": "0"}),
    "run": (
        doo3d.run,
        {
            "capture": capture(), "out": "out", "config": None, "mask": None, "input_options": None, "pose": None, "camera": None,
            "cameras": None, "every": 1, "start": None, "end": None, "frames": None, "workers": 0, "scheduler": None,
            "fuse_views": False, "sequence": False, "restart": False, "retry_failed": False, "time_limit": 60.0, "points": None,
            "pictures": "none", "picture_format": "jpg", "instances": False, "force": True, "progress": None, "box": None,
        },
    ),
    "report": (doo3d.report, {"results": "out", "out": None, "clouds": False, "min_confidence": 0.5, "force": True}),
    "pose": (as_pose, {"numbers": np.eye(4)}),
}  # fmt: skip
NOT_CALLED = {"DooError", "InputError", "ArgumentError", "ConfigError", "MissingDependency", "UnknownFrame"}


def use(result: Any) -> None:
    """Show a result in every way that a prompt and a notebook do."""
    repr(result)
    for name in ("_repr_html_", "summary", "to_dict", "to_yaml", "table", "in_camera"):
        method = getattr(result, name, None)
        if callable(method):
            method()


def outcome(name: str, argument: str, value: Any) -> str:
    """Return what a call with one hostile argument ends in: "" if that is a result or an error of doo3d."""
    function, good = CALLS[name]
    try:
        use(function(**good | {argument: value}))
    except DooError as error:
        return "" if len(str(error)) < 3000 and error.code else f"an error of {len(str(error))} letters"
    except Exception as error:
        return f"{type(error).__name__}: {str(error)[:150]}"
    return ""


def test_every_public_name_is_called():
    assert {name.split(".")[0].split(" ")[0] for name in CALLS} >= set(doo3d.__all__) - NOT_CALLED


def test_every_field_is_given():
    for kind in (doo3d.Camera, doo3d.Frame, doo3d.Image, doo3d.Cloud, doo3d.Chain, doo3d.Detection):
        assert set(CALLS[kind.__name__][1]) == {field.name for field in dataclasses.fields(kind) if field.init}
    for name in ("detect", "explain", "draw", "detect_sequence", "fuse", "run", "report", "load_config"):
        assert set(CALLS[name][1]) == set(inspect.signature(CALLS[name][0]).parameters)


@pytest.mark.parametrize("name", CALLS)
def test_the_arguments_work(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if name not in ("Config", "ReadOptions", "export", "to_newton", "open_capture", "open_rig", "report", "fuse"):
        function, good = CALLS[name]
        use(function(**good))


@pytest.mark.slow
@pytest.mark.parametrize("name", CALLS)
def test_a_hostile_argument_gives_a_result_or_an_error_of_doo3d(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = {}
    for argument in CALLS[name][1]:
        for label, value in hostile_values().items():
            if ended := outcome(name, argument, value):
                found[f"{argument} = {label}"] = ended
    assert not found, "\n".join(f"{call}: {ended}" for call, ended in found.items())
