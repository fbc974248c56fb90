import numpy as np
import pytest
from builders.chains import LENGTH, START, capture, helix, ring
from pxr import Usd, UsdGeom

import doo3d


def world_points(stage, name, code):
    prim = stage.GetPrimAtPath(f"/doo3d/{name}")
    matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(code))
    points = np.array(UsdGeom.BasisCurves(prim).GetPointsAttr().Get(code))
    return points @ matrix[:3, :3] + matrix[3, :3]


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd"])
def test_curves_move_with_the_stamps(tmp_path, suffix):
    frames = capture()
    stage = Usd.Stage.Open(str(doo3d.export(frames, "usd", tmp_path / f"chains{suffix}")[0]))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert stage.GetTimeCodesPerSecond() == 30
    assert stage.GetRootLayer().customLayerData["doo3d:start"] == START
    curve = UsdGeom.BasisCurves(stage.GetPrimAtPath("/doo3d/chain0"))
    assert curve.GetTypeAttr().Get() == "linear"
    codes = [(frame.timestamp - START) * 30 for frame in frames]
    assert curve.GetPointsAttr().GetTimeSamples() == pytest.approx([codes[0], codes[2]])
    for frame, code in zip(frames, codes, strict=True):
        for chain_id in (0, 3):
            prim = UsdGeom.BasisCurves(stage.GetPrimAtPath(f"/doo3d/chain{chain_id}"))
            chain = next((chain for chain in frame.chains if chain.id == chain_id), None)
            assert prim.GetVisibilityAttr().Get(code) == ("inherited" if chain else "invisible")
            if chain:
                np.testing.assert_allclose(np.array(prim.GetPointsAttr().Get(code)), chain.joints, atol=1e-6)
                np.testing.assert_allclose(np.array(prim.GetWidthsAttr().Get(code)), 2 * chain.radii, rtol=1e-6)
                assert list(prim.GetCurveVertexCountsAttr().Get(code)) == [len(chain.joints)]
                occluded = prim.GetPrim().GetAttribute("doo3d:occluded").Get(code)
                assert list(occluded) == chain.occluded.tolist()
                filled = prim.GetPrim().GetAttribute("doo3d:depthFilled").Get(code)
                assert list(filled) == chain.depth_filled.tolist()


def test_up_is_up(tmp_path):
    camera = Usd.Stage.Open(str(doo3d.export(capture()[0], "usd", tmp_path / "camera.usda")[0]))
    assert UsdGeom.GetStageUpAxis(camera) == "Y"
    np.testing.assert_allclose(world_points(camera, "chain0", Usd.TimeCode.Default()), helix().joints * (1, -1, -1), atol=1e-6)
    world = Usd.Stage.Open(str(doo3d.export(capture("world")[0], "usd", tmp_path / "world.usda")[0]))
    assert UsdGeom.GetStageUpAxis(world) == "Z"
    np.testing.assert_allclose(world_points(world, "chain0", Usd.TimeCode.Default()), helix().joints, atol=1e-6)


def test_a_ring_is_periodic(tmp_path):
    stage = Usd.Stage.Open(str(doo3d.export(doo3d.Detection((ring(),)), "usd", tmp_path / "ring.usda")[0]))
    curve = UsdGeom.BasisCurves(stage.GetPrimAtPath("/doo3d/chain0"))
    assert curve.GetWrapAttr().Get() == "periodic"
    points = np.array(curve.GetPointsAttr().Get())
    assert len(points) == 40
    np.testing.assert_allclose(np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1), LENGTH, rtol=1e-4)


def test_frames_without_stamps_follow_each_other(tmp_path):
    frames = [doo3d.Detection((helix(id=0),), frame=str(i)) for i in range(3)]
    stage = Usd.Stage.Open(str(doo3d.export(frames, "usd", tmp_path / "chains.usda", rate=24)[0]))
    assert UsdGeom.BasisCurves(stage.GetPrimAtPath("/doo3d/chain0")).GetPointsAttr().GetTimeSamples() == pytest.approx([0, 1, 2])
