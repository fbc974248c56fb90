"""Export USD scenes: curves with widths, animated by the timestamps of the capture."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from ..errors import require
from ..types import Chain, Detection, Floats
from .base import RadiusExport, colors, is_z_up, labels, times


class Usd(RadiusExport):
    """Export format OpenUSD: a scene with one linear UsdGeom.BasisCurves per chain, animated over the frames of a capture.

    All curves are below the Xform /doo3d, in m; those of a branched object are below an Xform of its own, such as
    /doo3d/object0, with its junctions as UsdGeom.Points. If the coordinates are a camera's (y down, z forward), the Xform /doo3d
    turns them to y up; otherwise the scene is z up.
    """

    summary: ClassVar[str] = "OpenUSD curves, animated over the capture"
    suffixes: ClassVar[tuple[str, ...]] = (".usda", ".usdc", ".usd")
    file_per: ClassVar[Any] = "capture"

    rate: float = Field(30.0, gt=0, description="time codes per second; also frames per second of a capture without timestamps")

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write all frames as one scene; the suffix of `path` chooses text (.usda) or binary (.usdc, .usd).

        With several frames, each is a time sample at the time code (t - t_first) * rate, where t is the frame's timestamp in s,
        or its number / rate if any frame has no timestamp. A single frame is written without time.

        Raises
        ------
        InputError
            the radius of a chain is unknown and the option `radius` is not set.
        MissingDependency
            OpenUSD (usd-core) is not installed.
        """
        pxr, stage = new_stage(path, frames, "Sdf", "Vt")
        geometry = pxr["UsdGeom"]
        codes = self._time_codes(stage, frames)
        parents = _objects(frames)
        for number in sorted(set(parents.values())):
            geometry.Xform.Define(stage, f"/doo3d/object{number}")
            members = {label for label, own in parents.items() if own == number}
            _junctions(pxr, stage, f"/doo3d/object{number}/junctions", frames, members, codes)
        all_labels = sorted({label for frame in frames for label in labels(frame)})
        for label in all_labels:
            above = f"/doo3d/object{parents[label]}" if label in parents else "/doo3d"
            _curve(pxr, stage, f"{above}/chain{label}", label, [_chain_of(frame, label) for frame in frames], codes, self)
        stage.GetRootLayer().Save()

    def _time_codes(self, stage: Any, frames: Sequence[Detection]) -> list[float | None]:
        """Return the time code of each frame; None (the default time) for a single frame."""
        stage.SetTimeCodesPerSecond(self.rate)
        stage.SetFramesPerSecond(self.rate)
        if len(frames) < 2:
            return [None] * len(frames)
        seconds = times(frames, self.rate)
        codes = [(second - seconds[0]) * self.rate for second in seconds]
        stage.SetStartTimeCode(codes[0])
        stage.SetEndTimeCode(codes[-1])
        stage.GetRootLayer().customLayerData = {"doo3d:start": float(seconds[0])}
        return list(codes)


def new_stage(path: Path, frames: Sequence[Detection], *modules: str) -> tuple[dict[str, Any], Any]:
    """Create a stage in metres for a new file, with an Xform /doo3d; return OpenUSD's modules by name, and the stage.

    The Xform turns the coordinates of a camera (y down, z away) to y up and z towards the viewer.

    Parameters
    ----------
    path
        the file.
    frames
        detections, in whose coordinates the stage is.
    modules
        names of modules that are needed besides Usd, UsdGeom and Gf.

    Raises
    ------
    MissingDependency : OpenUSD is not installed.
    """
    pxr = {name: require(f"pxr.{name}", "usd") for name in ("Usd", "UsdGeom", "Gf", *modules)}
    stage, geometry = pxr["Usd"].Stage.CreateNew(str(path)), pxr["UsdGeom"]
    z_up = all(is_z_up(frame) for frame in frames)
    geometry.SetStageUpAxis(stage, geometry.Tokens.z if z_up and frames else geometry.Tokens.y)
    geometry.SetStageMetersPerUnit(stage, 1.0)
    root = geometry.Xform.Define(stage, "/doo3d")
    if not z_up:
        root.AddRotateXOp().Set(180.0)
    stage.SetDefaultPrim(root.GetPrim())
    return pxr, stage


def sphere_arrays(pxr: dict[str, Any], points: Floats, widths: Floats) -> list[Any]:
    """Return points (N, 3) m, widths (N,) m, and the bounding box of the spheres, as arrays of OpenUSD.

    pxr : modules of OpenUSD. points : (N, 3) m. widths : (N,) m, diameters.
    """
    vt, half = pxr["Vt"], widths.max(initial=0.0) / 2
    box = np.array([points.min(axis=0) - half, points.max(axis=0) + half]) if len(points) else np.zeros((2, 3))
    pairs = ((vt.Vec3fArray, points), (vt.FloatArray, widths), (vt.Vec3fArray, box))
    return [kind.FromNumpy(values.astype(np.float32)) for kind, values in pairs]


def _chain_of(frame: Detection, label: int) -> Chain | None:
    return next((chain for number, chain in zip(labels(frame), frame.chains, strict=True) if number == label), None)


def _objects(frames: Sequence[Detection]) -> dict[int, int]:
    """Return label of each chain -> branched object of the capture, numbered in the order of appearance.

    A chain belongs to the object in which it is first connected to other chains.
    """
    result: dict[int, int] = {}
    count = 0
    for frame in frames:
        numbers = labels(frame)
        for item in frame.objects:
            if not item.junctions:
                continue
            members = [numbers[chain] for chain in item.chains]
            known = next((result[label] for label in members if label in result), count)
            count += known == count
            for label in members:
                result.setdefault(label, known)
    return result


def _junctions(
    pxr: dict[str, Any], stage: Any, path: str, frames: Sequence[Detection], members: set[int], codes: list[float | None]
) -> None:
    """Define the junctions of one object as points, at each time code; a frame without junctions has no points.

    Parameters
    ----------
    pxr, stage, codes
        as for `_curve`.
    path
        path of the points in the stage.
    frames
        the frames.
    members
        labels of the object's chains.
    """
    geometry, vt, types = pxr["UsdGeom"], pxr["Vt"], pxr["Sdf"].ValueTypeNames
    points = geometry.Points.Define(stage, path)
    points.SetWidthsInterpolation(geometry.Tokens.vertex)
    counts = points.GetPrim().CreateAttribute("doo3d:endCounts", types.IntArray, True)
    chains = points.GetPrim().CreateAttribute("doo3d:chains", types.IntArray, True)
    attributes = points.CreatePointsAttr(), points.CreateWidthsAttr(), points.CreateExtentAttr(), counts, chains
    for frame, code in zip(frames, codes, strict=True):
        when = () if code is None else (pxr["Usd"].TimeCode(code),)
        numbers = labels(frame)
        own = [each for each in frame.junctions if members & {numbers[end.chain] for end in each.ends}]
        at = np.array([each.position for each in own]).reshape(-1, 3)
        widths = np.array([2 * np.nanmax([0.0, *each.radii]) for each in own])
        values = (
            *sphere_arrays(pxr, at, widths),
            vt.IntArray([len(each.ends) for each in own]),
            vt.IntArray([numbers[end.chain] for each in own for end in each.ends]),
        )
        for attribute, value in zip(attributes, values, strict=True):
            attribute.Set(value, *when)


def _curve(
    pxr: dict[str, Any], stage: Any, path: str, label: int, chains: list[Chain | None], codes: list[float | None], kind: Usd
) -> None:
    """Define the curve of one chain, at each time code.

    Parameters
    ----------
    pxr
        modules of OpenUSD by name.
    stage
        the Usd.Stage.
    path
        path of the curve in the stage.
    label
        label of the chain.
    chains
        the chain in each frame; None where it is missing.
    codes
        time code of each frame.
    kind
        the format with its options.
    """
    geometry, vt, types = pxr["UsdGeom"], pxr["Vt"], pxr["Sdf"].ValueTypeNames
    curve = geometry.BasisCurves.Define(stage, path)
    curve.CreateTypeAttr(geometry.Tokens.linear)
    first = next(chain for chain in chains if chain is not None)
    ring = first.closed and all(chain is None or chain.closed for chain in chains)
    curve.CreateWrapAttr(geometry.Tokens.periodic if ring else geometry.Tokens.nonperiodic)
    curve.SetWidthsInterpolation(geometry.Tokens.vertex)
    curve.CreateDisplayColorAttr([pxr["Gf"].Vec3f(*(float(part) / 255 for part in colors(label)[0]))])
    prim = curve.GetPrim()
    occluded = prim.CreateAttribute("doo3d:occluded", types.BoolArray, True)
    filled = prim.CreateAttribute("doo3d:depthFilled", types.BoolArray, True)
    prim.CreateAttribute("doo3d:segmentLength", types.Double, True).Set(first.segment_length)
    attributes = curve.CreatePointsAttr(), curve.CreateWidthsAttr(), curve.CreateExtentAttr(), curve.CreateCurveVertexCountsAttr()
    for chain, code in zip(chains, codes, strict=True):
        when = () if code is None else (pxr["Usd"].TimeCode(code),)
        if code is not None:
            curve.CreateVisibilityAttr().Set(geometry.Tokens.invisible if chain is None else geometry.Tokens.inherited, *when)
        if chain is None:
            continue
        points = chain.joints[:-1] if ring else chain.joints  # a periodic curve closes itself
        widths = 2 * kind.radii_of(chain)[: len(points)]
        values = (*sphere_arrays(pxr, points, widths), vt.IntArray([len(points)]))
        for attribute, value in zip(attributes, values, strict=True):
            attribute.Set(value, *when)
        occluded.Set(vt.BoolArray(chain.occluded.tolist()), *when)
        filled.Set(vt.BoolArray(chain.depth_filled.tolist()), *when)
