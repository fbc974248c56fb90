"""usd-cable and to_newton: read by OpenUSD, loaded and stepped by Newton on the CPU."""

import importlib.util
import warnings

import numpy as np
import pytest
from builders.chains import LENGTH, RADIUS, along, flat, helix, ring
from builders.errors import refuses
from pxr import Usd, UsdGeom, UsdPhysics, UsdShade, UsdValidation
from test_trees import harness  # noqa: F401

import doo3d
from doo3d.types import Plane

DENSITY = 1100
HEIGHT = 0.6  # m of a camera above a table


def mass(detection):
    return sum(DENSITY * np.pi * chain.radius**2 * chain.length for chain in detection.chains)


def found(chain=None, **values):
    return doo3d.Detection((chain or helix(),), **{"coordinates": "world"} | values)


def lying(noise=0.0):
    """Return an S of 40 cm on a table that a camera looks down at, with joints up to some 2 `noise` m too high."""
    line = np.zeros((41, 3))
    heading = 1.2 * np.sin(np.linspace(0, 2 * np.pi, 40))
    line[1:, :2] = np.cumsum(LENGTH * np.column_stack((np.cos(heading), np.sin(heading))), axis=0)
    line[:, 2] = HEIGHT - RADIUS - noise * (1 + np.sin(0.7 * np.arange(41)))
    return found(along(line), coordinates="camera", plane=Plane((0.0, 0.0, -1.0), -HEIGHT))


def written(tmp_path, detection, suffix=".usda", **options):
    return doo3d.export(detection, "usd-cable", tmp_path / f"{len(list(tmp_path.iterdir()))}{suffix}", **options)[0]


def attribute(prim, name):
    return np.array(prim.GetAttribute(name).Get())


def opened(*args, **options):
    return Usd.Stage.Open(str(written(*args, **options)))


# --- OpenUSD ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
def test_the_validators_of_usd_find_nothing(tmp_path, harness, suffix):  # noqa: F811
    for detection, rest in ((lying(), "detected"), (found(ring()), "straight"), (harness, "straight")):
        stage = opened(tmp_path, detection, suffix, rest=rest)
        validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
        assert [error.GetMessage() for error in UsdValidation.ValidationContext(validators).Validate(stage)] == []


def test_a_cable_is_a_curve_with_thicknesses_and_a_material(tmp_path):
    stage, chain = opened(tmp_path, lying(), bending=1e-3, friction=0.7), lying().chains[0]
    prim = stage.GetPrimAtPath("/doo3d/chain0")
    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == ("Z", 1)
    schemas = set(prim.GetMetadata("apiSchemas").GetAppliedItems())
    assert schemas == {"PhysicsCurvesDeformableSimAPI", "PhysicsCollisionAPI", "MaterialBindingAPI"}
    assert (attribute(prim, "type"), attribute(prim, "wrap")) == ("linear", "nonperiodic")
    points = attribute(prim, "points")
    np.testing.assert_allclose(attribute(prim, "physics:thicknesses"), 2 * chain.radii, rtol=1e-6)
    assert attribute(prim, "physics:thicknesses:elementType") == "point"
    np.testing.assert_array_equal(attribute(prim, "physics:restShapePoints"), points)
    np.testing.assert_allclose(points[:, 2], RADIUS, atol=1e-6)  # on the ground, z up
    pose = np.array(stage.GetRootLayer().customLayerData["doo3d:pose"]).T
    np.testing.assert_allclose(chain.joints @ pose[:3, :3].T + pose[:3, 3], points, atol=1e-6)
    material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")[0].GetPrim()
    assert attribute(material, "physics:density") == DENSITY
    assert attribute(material, "physics:curvesBendStiffness") == pytest.approx(1e-3)
    assert attribute(material, "physics:dynamicFriction") == pytest.approx(0.7)
    assert not material.HasAttribute("physics:curvesTwistStiffness")
    ground = stage.GetPrimAtPath("/doo3d/ground")
    assert ground.HasAPI(UsdPhysics.CollisionAPI)


@pytest.mark.parametrize("chain", [helix(), ring()], ids=["helix", "ring"])
def test_the_shape_at_rest_is_as_long_and_straight(tmp_path, chain):
    stage = opened(tmp_path, found(chain), rest="straight", segments=30)
    prim = stage.GetPrimAtPath("/doo3d/chain0")
    points, rest = (attribute(prim, name) for name in ("points", "physics:restShapePoints"))
    assert attribute(prim, "curveVertexCounts").tolist() == [len(points)] == [30 if chain.closed else 31]
    if chain.closed:
        points, rest = (np.concatenate((each, each[:1])) for each in (points, rest))
        assert attribute(prim, "wrap") == "periodic"
        assert np.ptp(np.linalg.norm(rest[:-1] - rest[:-1].mean(axis=0), axis=1)) < 1e-6
    else:
        assert np.linalg.matrix_rank(rest - rest[0], tol=1e-5) == 1
    steps = [np.linalg.norm(np.diff(each, axis=0), axis=1) for each in (points, rest)]
    np.testing.assert_allclose(*steps, rtol=2e-4)


def test_chains_meet_at_their_junctions(tmp_path, harness):  # noqa: F811
    stage = opened(tmp_path, harness)
    attached = [prim for prim in stage.Traverse() if prim.GetTypeName() == "PhysicsAttachment"]
    assert len(attached) == sum(len(junction.ends) - 1 for junction in harness.junctions) > 0
    for prim in attached:
        places = []
        for side in "01":
            curve = stage.GetPrimAtPath(prim.GetRelationship(f"physics:src{side}").GetTargets()[0])
            places.append(attribute(curve, "points")[attribute(prim, f"physics:indices{side}")[0]])
        assert np.array_equal(*places)
        assert min(np.linalg.norm(junction.position - places[0]) for junction in harness.junctions) < 1e-6


# --- Newton ----------------------------------------------------------------------------------------------------------------


@pytest.mark.skipif(importlib.util.find_spec("newton") is not None, reason="Newton is installed")
def test_newton_has_to_be_installed():
    with refuses("missing-package", "doo3d[newton]", kind=doo3d.MissingDependency):
        doo3d.to_newton(None, lying())


def test_arguments_of_the_wrong_kind_are_refused():
    with refuses("argument-type", "detection", kind=doo3d.ArgumentError):
        doo3d.to_newton(None, "results")
    with refuses("results-2d"):
        doo3d.to_newton(None, flat())
    with refuses("key-unknown", "densty", kind=doo3d.ConfigError):
        doo3d.to_newton(None, lying(), densty=1)


@pytest.fixture(scope="module")
def newton():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        module = pytest.importorskip("newton")
        pytest.importorskip("newton_usd_schemas")
    return module


@pytest.fixture(params=["usd-cable", "to_newton"])
def loaded(newton, tmp_path, request):
    """Return a function that returns a Newton model under construction with the cables of a detection."""

    def load(detection, **options):
        builder = newton.ModelBuilder()
        builder.rigid_gap = RADIUS
        if request.param == "to_newton":
            made = doo3d.to_newton(builder, detection, **options)
            assert [len(bodies) for bodies in made.bodies] == [max(2, len(chain.occluded)) for chain in detection.chains]
            assert len(made.junctions) == sum(len(junction.ends) - 1 for junction in detection.junctions)
        else:
            builder.add_usd(str(written(tmp_path, detection, **options)))
        return builder

    return load


def simulated(newton, builder):
    """Return the centers of the segments, (S, 3) m, before and after a second; a step is 1/600 s."""
    builder.color()
    model = builder.finalize(device="cpu")
    pipeline, solver = newton.CollisionPipeline(model), newton.solvers.SolverVBD(model, iterations=5)
    contacts, control = pipeline.contacts(), model.control()
    state, after = model.state(), model.state()
    before = state.body_q.numpy()[:, :3].copy()
    for _ in range(600):
        state.clear_forces()
        pipeline.collide(state, contacts)
        solver.step(state, after, control, contacts, 1 / 600)
        state, after = after, state
    return before, state.body_q.numpy()[:, :3]


def test_bodies_are_segments_and_weigh_as_much(loaded, harness):  # noqa: F811
    for detection in (lying(), found(ring()), harness):
        for rest in ("detected", "straight"):
            builder = loaded(detection, rest=rest)
            assert builder.body_count == sum(len(chain.occluded) for chain in detection.chains)
            assert sum(builder.body_mass) == pytest.approx(mass(detection), rel=0.01)
    assert loaded(found(helix(1))).body_count == 2


@pytest.mark.slow
def test_a_cable_on_a_table_stays(newton, loaded):
    for detection in (lying(), lying(0.001)):
        before, after = simulated(newton, loaded(detection))
        assert np.linalg.norm(after - before, axis=1).max() < RADIUS
        assert after[:, 2].min() > 0.9 * RADIUS


@pytest.mark.slow
def test_a_straight_cable_stretches_itself(newton, loaded):
    before, after = simulated(newton, loaded(lying(), rest="straight", youngs=1e7))
    assert np.linalg.norm(after[-1] - after[0]) > 1.05 * np.linalg.norm(before[-1] - before[0])


@pytest.mark.slow
def test_a_branched_object_stays_together(newton, loaded, harness):  # noqa: F811
    before, after = simulated(newton, loaded(harness))
    np.testing.assert_allclose(after[:, :2], before[:, :2], atol=harness.chains[0].radius)
    assert after[:, 2].min() > before[:, 2].min() - harness.chains[0].radius
