import numpy as np
import pytest
import trimesh
from builders.chains import RADIUS, capture, helix, ring

import doo3d
from doo3d.exports.base import colors


def cylinders(mesh):
    """The bodies of a mesh, each closed."""
    bodies = mesh.split(only_watertight=False)
    assert all(body.is_watertight and body.is_winding_consistent and body.volume > 0 for body in bodies)
    return bodies


def load(path):
    return trimesh.load(path, process=False)


def scene_of(path):
    scene = trimesh.load_scene(path, process=False, **({"split_objects": True} if path.suffix == ".obj" else {}))
    return {name: scene.geometry[scene.graph[name][1]] for name in scene.graph.nodes_geometry}, scene


@pytest.mark.parametrize("chain", [helix(id=0), helix(1, id=0), ring()], ids=["helix", "one segment", "ring"])
def test_a_closed_cylinder_per_segment(tmp_path, chain):
    found = doo3d.Detection((chain,))
    mesh = load(doo3d.export(found, "ply", tmp_path / "mesh.ply")[0])
    bodies = cylinders(mesh)
    assert len(bodies) == len(chain.occluded)
    middles = (chain.joints[1:] + chain.joints[:-1]) / 2
    distances = np.linalg.norm(np.array([body.bounds.mean(axis=0) for body in bodies])[:, None] - middles[None], axis=2)
    assert distances.min(axis=0).max() < 1e-5
    share = 16 / (2 * np.pi) * np.sin(2 * np.pi / 16)  # of the circle that the polygon covers
    np.testing.assert_allclose([body.volume for body in bodies], np.pi * RADIUS**2 * 0.01 * share, rtol=1e-4)


def test_colors_are_the_chains_and_paler_where_occluded(tmp_path):
    frame = capture()[0]
    mesh = load(doo3d.export(frame, "ply", tmp_path / "mesh.ply")[0])
    shades, counts = np.unique(mesh.visual.vertex_colors[:, :3], axis=0, return_counts=True)
    wanted = {color: 34 * int((chain.occluded == bool(hidden)).sum()) for chain in frame.chains
              for hidden, color in enumerate(colors(chain.id))}  # fmt: skip
    assert {tuple(map(int, shade)): int(count) for shade, count in zip(shades, counts, strict=True)} == wanted


@pytest.mark.parametrize("kind", ["obj", "glb"])
def test_an_object_per_chain_and_occluded_parts_apart(tmp_path, kind):
    frame = capture("world")[0]
    parts, scene = scene_of(doo3d.export(frame, kind, tmp_path / f"mesh.{kind}")[0])
    assert set(parts) == {"chain0", "chain0_occluded", "chain3", "chain3_occluded"}
    for chain in frame.chains:
        for hidden, color in enumerate(colors(chain.id)):
            part = parts[f"chain{chain.id}" + "_occluded" * hidden]
            assert len(cylinders(part)) == (chain.occluded == bool(hidden)).sum()
            np.testing.assert_allclose(
                np.asarray(part.visual.vertex_colors)[:, :3], np.tile(color, (len(part.vertices), 1)), atol=1
            )
    assert scene.bounds is not None


def test_obj_stands_where_the_chain_does(tmp_path):
    chain = helix()
    _, scene = scene_of(doo3d.export(doo3d.Detection((chain,)), "obj", tmp_path / "mesh.obj")[0])
    np.testing.assert_allclose(scene.bounds, [chain.joints.min(axis=0), chain.joints.max(axis=0)], atol=RADIUS + 1e-6)


@pytest.mark.parametrize(
    ("coordinates", "to_y_up"), [("camera", lambda p: p * (1, -1, -1)), ("world", lambda p: p[:, [0, 2, 1]] * (1, 1, -1))]
)
def test_gltf_is_upright(tmp_path, coordinates, to_y_up):
    chain = helix()
    _, scene = scene_of(doo3d.export(doo3d.Detection((chain,), coordinates=coordinates), "glb", tmp_path / "mesh.glb")[0])
    wanted = to_y_up(chain.joints)
    np.testing.assert_allclose(scene.bounds, [wanted.min(axis=0), wanted.max(axis=0)], atol=RADIUS + 1e-6)
