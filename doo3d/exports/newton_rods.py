"""Add chains to a model of Newton that a program builds, without a file."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..errors import InputError, require
from ..types import ChainEnd, Detection, Floats
from ..types.arguments import refused
from .registry import export_of
from .trees import grown
from .usd_cable import Cable, UsdCable

RIGIDITIES = {"stretching": "stretch", "shearing": "shear", "bending": "bend", "twisting": "twist"}  # names in Newton


class NewtonCables(NamedTuple):
    """The parts of a Newton model that `to_newton` added.

    Attributes
    ----------
    bodies
        the bodies of each chain of the detection: their indices in the model, one per segment, in the order of the segments.
    joints
        the rod joints of each chain, between its segments.
    junctions
        the ball joints that hold chains together where they meet.
    pose
        (4, 4) m, pose of the detection's coordinates in the model: p_model = pose @ p_detection.
    """

    bodies: tuple[tuple[int, ...], ...]
    joints: tuple[tuple[int, ...], ...]
    junctions: tuple[int, ...]
    pose: Floats


def to_newton(builder: Any, detection: Detection, **options: Any) -> NewtonCables:
    """Add the chains of a detection to a Newton model, one rod per chain, and the ground under them.

    As in the format "usd-cable", gravity is along -z and the ground at z = 0; the coordinates of a world or of a robot's base
    frame are kept. Contacts are looked for within a radius of each segment, since the default of the builder, 0.1 m, finds more
    of them than Newton's solver for cables, SolverVBD, keeps.

    Parameters
    ----------
    builder
        the newton.ModelBuilder, with z up.
    detection
        the detection, 3-D, in m.
    **options
        options of the format "usd-cable", such as bending=1e-3 or rest="straight".

    Returns
    -------
    NewtonCables
        the indices of bodies and joints, and the pose of the detection in the model.

    Raises
    ------
    ArgumentError
        an argument has the wrong type.
    ConfigError
        an option does not exist or is out of bounds.
    InputError
        the detection is 2-D, a radius is unknown and the option `radius` is not set, or `builder` has another axis up.
    MissingDependency
        Newton is not installed.
    """
    if not isinstance(detection, Detection):
        raise refused(detection, "detection", "a Detection")
    kind = export_of("usd-cable", options)
    assert isinstance(kind, UsdCable)
    if detection.mode == "2d":
        raise InputError(f"frame {detection.frame} is 2-D, in pixels, and Newton needs 3-D", code="results-2d")
    newton, warp = require("newton", "newton"), require("warp", "newton")
    if not isinstance(builder, newton.ModelBuilder):
        raise refused(builder, "builder", "a newton.ModelBuilder")
    if builder.up_axis != newton.Axis.Z:
        raise InputError("to_newton needs a builder with z up: newton.ModelBuilder(up_axis='Z')", code="options-conflict")
    scene = kind.scene(detection)
    tree = grown(scene.frames[0])
    cables = kind.cables(scene.frames[0], tree)
    config = builder.default_shape_cfg.copy()
    config.mu = kind.friction
    if scene.ground is not None:
        turn = Rotation.align_vectors([scene.ground[1]], [(0.0, 0.0, 1.0)])[0].as_quat()
        builder.add_shape_plane(xform=warp.transform(scene.ground[0], turn), width=0.0, length=0.0, cfg=config)
    rods = [_add_rod(newton, builder, kind, config.copy(), cable) for cable in cables]
    for first, second in kind.apart(cables, tree):
        shapes = (builder.body_shapes[rods[part.chain][0][part.segment]][0] for part in (first, second))
        builder.add_shape_collision_filter_pair(*shapes)
    junctions = [
        _join(warp, builder, cables, [bodies for bodies, _ in rods], (first, other))
        for first, *others in tree.junctions
        for other in others
    ]
    kept = [np.array_equal(a.joints[0], b.joints[0]) for a, b in zip(tree.detection.chains, scene.frames[0].chains, strict=True)]
    return NewtonCables(
        tuple(tuple(bodies if same else bodies[::-1]) for (bodies, _), same in zip(rods, kept, strict=True)),
        tuple(tuple(joints if same else joints[::-1]) for (_, joints), same in zip(rods, kept, strict=True)),
        tuple(junctions),
        np.eye(4) if scene.pose is None else scene.pose,
    )


def _add_rod(newton: Any, builder: Any, kind: UsdCable, config: Any, cable: Cable) -> tuple[list[int], list[int]]:
    """Add one cable to a model, and return its bodies and its joints; config : of its shapes, with the friction."""
    chain, points = cable.bodies.chain, cable.joints
    radius, length = kind.radius_of(chain), chain.segment_length
    config.gap = radius
    config.density = kind.density / (1 + 4 * radius / (3 * length))  # of capsules that weigh as much as cylinders
    rod = newton.Rod(
        np.concatenate((points, points[:1])) if chain.closed else points,
        rest_straight=kind.rest == "straight",
        closed=chain.closed,
        radius=radius,
        **{f"{RIGIDITIES[mode]}_rigidity": value for mode, value in kind.stiffnesses(radius).items()},
    )
    damping = kind.damping / length
    bodies, joints = builder.add_rod(rod=rod, cfg=config, bend_damping=damping, twist_damping=damping, label=cable.bodies.name)
    return bodies, joints


def _join(warp: Any, builder: Any, cables: Sequence[Cable], bodies: Sequence[list[int]], ends: Sequence[ChainEnd]) -> int:
    """Add a ball joint between the ends of two cables, and return it.

    Parameters
    ----------
    warp, builder
        the module, and the model.
    cables, bodies
        the cables, and the bodies of each.
    ends
        the two ends.
    """
    bodies_of_ends, poses = [], []
    for each in ends:
        cable = cables[each.chain]
        length = np.linalg.norm(np.diff(cable.joints, axis=0), axis=1)[-each.end]
        bodies_of_ends.append(bodies[each.chain][-each.end])
        poses.append(warp.transform((0.0, 0.0, float(length) * (each.end - 0.5)), warp.quat_identity()))
    parent, child = bodies_of_ends
    return int(builder.add_joint_ball(parent=parent, child=child, parent_xform=poses[0], child_xform=poses[1]))
