"""Frames of a thing at rest, fused by the camera's poses: what one of them misses is there, exact, in the world."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
import pytest
from builders.errors import code_in, refuses
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from doo3d.config import Config, load_config
from doo3d.errors import InputError
from doo3d.evaluation.benchmark.fused_views import RenderedView, circle_views, fused_score, seen_fraction, with_block
from doo3d.evaluation.scenes.model import Scene
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.fusion import fuse as fusion
from doo3d.fusion.camera_at_rest import check_camera_moved
from doo3d.fusion.fuse import fuse
from doo3d.fusion.fused_capture import fused_capture
from doo3d.inputs import Capture, FrameData, FrameRef
from doo3d.pipeline import detect
from doo3d.scene.multiview_model import MultiViewDepthModel, PointVisibility
from doo3d.types import Cloud, Image

CONFIG = load_config("default")


@lru_cache
def scene(family: str = "crossings", seed: int = 2) -> Scene:
    return with_block(make_scene(family, seed, (640, 480)))


@lru_cache
def views(family: str = "crossings", seed: int = 2, count: int = 4, sensor: str = "d435") -> tuple[RenderedView, ...]:
    return tuple(circle_views(scene(family, seed), count, sensor=sensor))


def frame_refs(seen: tuple[RenderedView, ...] = ()) -> list[FrameRef]:
    return [view.ref() for view in seen or views()]


def frame_ref(shot: FrameData | Exception, name: str = "other") -> FrameRef:
    return FrameRef(name, Path(name), partial(give, shot))


def give(shot):
    if isinstance(shot, Exception):
        raise shot
    return shot


def shot_of(view: RenderedView, **changes) -> FrameData:
    return replace(FrameData(view.rendered.frame, view.rendered.mask, view.pose), **changes)


@pytest.mark.slow
def test_what_one_view_misses_comes_into_view():
    """Each view hides another part, and four show more than any one; all of it is found, in one piece, within 0.5 mm."""
    own = views()
    assert seen_fraction(list(own)) > max(seen_fraction([view]) for view in own) + 0.05
    alone, together = (fused_score(scene(), list(some), CONFIG) for some in (own[:1], own))
    assert not alone.correct
    assert together.correct
    assert together.coverage > 0.98
    assert together.rms_seen < 0.5 < alone.rms_hidden
    assert together.radius_ratio == pytest.approx(1, abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(("sensor", "most"), [("none", 0.4), ("d435", 0.4)])
def test_more_views_of_stereo_depth_do_not_blow_the_radius_up(sensor, most):
    """A circle through the cloud would: it gets the radius up to 10 % and the axis 1 mm wrong."""
    found = fused_score(scene("open", 1), list(views("open", 1, 8, sensor)), CONFIG)
    assert found.correct
    assert found.radius_ratio == pytest.approx(1, abs=0.01)
    assert found.rms_seen < most


@pytest.mark.slow
def test_free_space_of_all_views_keeps_two_cables_apart():
    """Their ends fit well across 14 cm of table that every camera sees; without what they see they are joined."""
    own = views("several", 6, 4)
    cloud = fuse(frame_refs(own), CONFIG)
    assert len(detect(cloud, CONFIG).chains) == 2
    assert fused_score(scene("several", 6), list(own), CONFIG).correct
    assert len(detect(replace(cloud, views=()), CONFIG).chains) == 1


def test_the_world_may_lie_anywhere():
    """Turned and shifted, the same is found, turned and shifted."""
    world = np.eye(4)
    world[:3, :3], world[:3, 3] = Rotation.from_euler("xyz", (100, 20, -50), degrees=True).as_matrix(), (3.0, -40.0, 2.0)
    moved = [frame_ref(shot_of(view, pose=world @ view.pose), str(k)) for k, view in enumerate(views())]
    here, there = detect(fuse(frame_refs(), CONFIG), CONFIG), detect(fuse(moved, CONFIG), CONFIG)
    assert len(here.chains) == len(there.chains) == 1
    back = (there.chains[0].joints - world[:3, 3]) @ world[:3, :3]
    assert cKDTree(scene().cables[0].axis).query(back)[0].max() < 0.003
    assert there.chains[0].length == pytest.approx(here.chains[0].length, abs=0.011)


def test_the_cloud_is_as_dense_as_one_frame_and_in_its_colors():
    cloud = fuse(frame_refs(), CONFIG)
    assert (cloud.coordinates, cloud.segmented) == ("world", True)
    assert cloud.colors is not None
    assert np.abs(np.median(cloud.colors, axis=0) - scene().cables[0].color).max() < 90
    one = views()[0].rendered
    assert 0.5 < len(cloud.points) / (one.mask & (one.frame.depth > 0)).sum() < 3
    gap = cKDTree(scene().cables[0].axis).query(cloud.points)[0]
    assert np.median(gap) == pytest.approx(scene().cables[0].radius, rel=0.1)


def test_the_same_every_time_and_two_by_two():
    one, two = (detect(fuse(frame_refs(), CONFIG), CONFIG) for _ in range(2))
    np.testing.assert_array_equal(one.chains[0].joints, two.chains[0].joints)


def test_what_few_frames_see_goes():
    """What one frame takes for the object, a hand's breadth above it, others see through."""
    first, *rest = views()
    depth = first.rendered.frame.depth.copy()
    mask = first.rendered.mask.copy()
    v, u = 240, 320
    mask[v : v + 20, u : u + 20], depth[v : v + 20, u : u + 20] = True, 0.4
    odd = shot_of(first, data=replace(first.rendered.frame, depth=depth), mask=mask)
    some = [frame_ref(odd, "odd"), *frame_refs(tuple(rest))]
    everything = fuse(some, load_config("default", {"fusion.min_views": 1}))
    kept = fuse(some, CONFIG)
    low = cKDTree(scene().cables[0].axis)
    before, after = ((low.query(cloud.points)[0] > 0.03).sum() for cloud in (everything, kept))
    assert before > 200
    assert after < 0.1 * before, "and that only where the others have no reading"


@pytest.mark.slow
def test_the_number_of_views_kept_does_not_grow_with_the_frames(monkeypatch):
    monkeypatch.setattr(fusion, "MAX_VIEWS", 4)
    for times in (1, 2, 3, 5):
        cloud = fuse(frame_refs(views() * times), CONFIG)
        assert 2 <= len(cloud.views) <= 4


def test_frames_that_cannot_be_used_are_named():
    some = [
        *frame_refs(),
        frame_ref(InputError("broken.png: is cut off", code="image-unreadable"), "broken"),
        frame_ref(shot_of(views()[0], pose=None), "lost"),
    ]
    some.append(frame_ref(shot_of(views()[0], pose=2 * np.eye(4)), "odd"))
    some.append(frame_ref(shot_of(views()[0], pose=np.diag([1.0, 1.0, -1.0, 1.0])), "mirrored"))
    some.append(frame_ref(shot_of(views()[0], pose=np.where(np.eye(4), 1.0, np.nan)), "nowhere"))
    some.append(frame_ref(FrameData(Image(np.zeros((4, 4, 3), np.uint8)), pose=np.eye(4)), "flat"))
    notes = fuse(some, CONFIG).notes
    assert notes[0] == "4 frames are fused"
    assert "broken is left out: broken.png: is cut off" in notes
    assert "1 frames without a pose are left out" in notes
    for name in ("odd", "mirrored", "nowhere"):
        assert any(note.startswith(f"{name} is left out: its pose") for note in notes)
    assert any(note.startswith("flat is left out: it is an image without depth") for note in notes)


def test_no_poses():
    with refuses("pose-missing", "trajectory=FILE"):
        fuse([frame_ref(shot_of(views()[0], pose=None))], CONFIG)


def test_a_camera_that_did_not_move():
    with refuses("camera-still", "3 frames", "--fuse-views"):
        fuse([frame_ref(shot_of(views()[0]), str(k)) for k in range(3)], CONFIG)
    near, turned = np.eye(4), np.eye(4)
    near[0, 3], turned[:3, :3] = 0.004, Rotation.from_euler("y", 2, degrees=True).as_matrix()
    with refuses("camera-still"):
        check_camera_moved(np.array([np.eye(4), near]))
    check_camera_moved(np.array([np.eye(4), turned]))


def test_nothing_can_be_used():
    with refuses("file-unreadable", "gone"):
        fuse([frame_ref(InputError("gone", code="file-unreadable"), "a")], CONFIG)
    with refuses("frames-unusable"):
        fuse([], CONFIG)


def test_what_only_one_frame_sees_stays_where_no_other_sees_through_it():
    """The block hides from each view what others show: some of it is shown by one only."""
    axis = scene().cables[0].axis
    shows = np.sum([view.rendered.truths[0].seen for view in views()], axis=0)
    once = axis[shows == 1]
    assert len(once) > 20
    gap = cKDTree(fuse(frame_refs(), CONFIG).points).query(once)[0]
    assert (gap < 2 * scene().cables[0].radius).mean() > 0.9


def test_a_2d_config_is_refused():
    with refuses("config-mode"):
        fused_capture(Capture(Path("views"), "memory", frame_refs()), load_config("image"))


@pytest.mark.slow
def test_clouds_with_poses():
    """Of a camera that says where it was but gives clouds there are no masks; they are fused all the same."""
    shots = []
    for view in views("open", 1, 4, "none"):
        frame, mask = view.rendered.frame, view.rendered.mask
        v, u = np.nonzero(mask & (frame.depth > 0))
        shots.append(FrameData(Cloud(frame.camera.unproject(np.column_stack((u, v)), frame.depth[v, u])), pose=view.pose))
    config = load_config("default", {"segment.method": "everything"})
    cloud = fuse([frame_ref(shot, str(k)) for k, shot in enumerate(shots)], config)
    assert cloud.views == ()
    (chain,) = detect(cloud, config).chains
    assert chain.radius == pytest.approx(scene("open", 1).cables[0].radius, rel=0.1)


def test_what_many_views_say_of_a_place():
    """On the cable it is seen; beside it, above the table, seen through; far away nothing is said."""
    visibility = MultiViewDepthModel.of_views(fuse(frame_refs(), CONFIG).views, 0.006, False)
    axis = scene().cables[0].axis
    up = scene().table.normal
    said = visibility.classify(axis)
    assert (said == PointVisibility.SURFACE).mean() > 0.9
    assert (visibility.classify(axis[:20] + 0.08 * up + 0.05) == PointVisibility.FREE).all()
    assert (visibility.classify(axis[:5] + 50.0) == PointVisibility.OUTSIDE).all()


def write(path: Path, poses: bool = True) -> Path:
    own = views()
    camera = own[0].rendered.frame.camera
    arrays = {
        "depth": np.stack([view.rendered.frame.depth for view in own]),
        "mask": np.stack([view.rendered.mask for view in own]),
        "K": np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]),
    } | ({"pose": np.stack([view.pose for view in own])} if poses else {})
    np.savez_compressed(path, **arrays)
    return path


def test_from_the_shell(tmp_path, doo3d):
    capture = write(tmp_path / "orbit.npz")
    code, out, _ = doo3d("detect", capture, "-o", "out", "--fuse-views")
    assert code == 0, out
    assert "static   1 chain" in out
    assert sorted(path.name for path in Path("out").glob("static.*")) == ["static.jpg", "static.json"]
    found = json.loads(Path("out/static.json").read_text())
    assert found["coordinates"] == "the world frame of the camera's poses"
    assert found["notes"] == ["4 frames are fused"]
    joints = np.array(found["chains"][0]["joints"])
    assert cKDTree(scene().cables[0].axis).query(joints)[0].max() < 0.003
    code, _, err = doo3d("detect", capture, "-o", "out")
    assert code == 2, "the frames one by one are another run"
    assert code_in(err) == "out-other-input"


def test_from_the_shell_without_poses(tmp_path, refused):
    refused(write(tmp_path / "still.npz", poses=False), "--fuse-views", code="pose-missing")
    refused(tmp_path / "still.npz", "--fuse-views", "-c", "image", code="config-mode")


@pytest.mark.slow
def test_frames_are_told_from_the_rest_as_the_config_says():
    """Without masks, by color; the cloud itself is not segmented again."""
    config = load_config("default", {"segment.method": "plane"})
    bare = [frame_ref(shot_of(view, mask=None), str(k)) for k, view in enumerate(views("open", 1, 4))]
    assert isinstance(config, Config)
    gap = cKDTree(scene("open", 1).cables[0].axis).query(fuse(bare, config).points)[0]
    assert (gap < 0.01).mean() > 0.5
