"""The inputs that the fuzzer changes: a small valid one of every format, and of every JSON and YAML that is read."""

from __future__ import annotations

import io
import json
import sys
import zipfile
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from builders.bags import SECOND, BagScript, packed_depth, png
from builders.lerobot import ramps
from builders.lerobot import write as write_lerobot

HEIGHT, WIDTH = 48, 64
PINHOLE = (60.0, 60.0, 31.5, 23.5)
MATRIX = [[60.0, 0.0, 31.5], [0.0, 60.0, 23.5], [0.0, 0.0, 1.0]]
POSE_LINE = "0.1 0.2 0.3 0 0 0 1"


def scene(shift: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Colour (BGR), depth (mm) and mask of a cable over a table."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    offset = np.abs(v - 24 - 8 * np.sin(u / 12 + shift))
    mask = offset < 2.6
    depth = np.where(mask, 480 - np.sqrt(np.maximum(2.6**2 - offset**2, 0)) * 4, 520).astype(np.uint16)
    color = np.where(mask[..., None], (30, 120, 220), (90, 95, 100)).astype(np.uint8)
    return color, depth, mask


def points() -> np.ndarray:
    """Points of the cable, (N, 3) m."""
    _, depth, mask = scene()
    v, u = np.nonzero(mask)
    z = depth[v, u] / 1000
    return np.column_stack(((u - PINHOLE[2]) * z / PINHOLE[0], (v - PINHOLE[3]) * z / PINHOLE[1], z))


def _save(path: Path, image: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if not cv2.imwrite(str(path), image):
        raise RuntimeError(f"{path} cannot be written")


def write_seeds(folder: Path) -> dict[str, Path]:
    """Write all inputs below a folder: name -> file or folder to open."""
    seeds = {**_folders(folder), **_files(folder), **_clouds(folder), **_bags(folder), **_pictures(folder), **_texts(folder)}
    return {name: path for name, path in seeds.items() if path.exists()}


def _folders(folder: Path) -> dict[str, Path]:
    color, depth, mask = scene()
    both = {"open3d": ("depth/0.png", "color/0.jpg"), "tum": ("depth/1.0.png", "rgb/1.0.png")}
    both |= dict.fromkeys(("icl", "bop"), ("depth/0.png", "rgb/0.png"))
    both |= {"redwood": ("depth/0000001-000000033369.png", "image/0000001-000000033369.jpg")}
    both |= {"roles": ("000_depth.png", "000_color.png"), "pairs": ("a.png", "a_color.png")}
    for name, (first, second) in both.items():
        _save(folder / name / first, depth)
        _save(folder / name / second, color)
    _save(folder / "open3d" / "mask" / "0.png", mask.astype(np.uint8) * 255)
    values = {"width": WIDTH, "height": HEIGHT, "intrinsic_matrix": [60, 0, 0, 0, 60, 0, 31.5, 23.5, 1], "depth_scale": 1000}
    text = json.dumps(values)
    (folder / "open3d" / "camera_intrinsic.json").write_text(text)
    (folder / "roles" / "camera.json").write_text(text)
    (folder / "open3d" / "pose.yaml").write_text("pose: {position: [0, 0, 1], orientation: [1, 0, 0, 0]}\n")
    (folder / "tum" / "depth.txt").write_text("# depth\n1.0 depth/1.0.png\n")
    (folder / "tum" / "rgb.txt").write_text("# color\n1.01 rgb/1.0.png\n")
    (folder / "tum" / "groundtruth.txt").write_text(f"1.0 {POSE_LINE}\n1.1 {POSE_LINE}\n")
    (folder / "icl" / "associations.txt").write_text("0 depth/0.png 0 rgb/0.png\n")
    (folder / "icl" / "a.gt.freiburg").write_text(f"0 {POSE_LINE}\n1 {POSE_LINE}\n")
    (folder / "redwood" / "traj.log").write_text("0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
    camera = {"cam_K": np.ravel(MATRIX).tolist(), "depth_scale": 1.0}
    camera |= {"cam_R_w2c": np.eye(3).ravel().tolist(), "cam_t_w2c": [0, 0, 9]}
    (folder / "bop" / "scene_camera.json").write_text(json.dumps({"0": camera}))
    (folder / "pairs" / "a.yaml").write_text(
        f"camera: {list(PINHOLE)}\ndepth_scale: 1000\ncolor: a_color.png\ntimestamp: 1.5\n"
        "pose: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
    )
    with suppress(ImportError):  # PyAV is not installed
        write_lerobot(folder / "lerobot", ramps(4), [color] * 4)
    both |= {"lerobot": ("", "")}
    return {**{name: folder / name for name in both}, "scannet": _scannet(folder / "scannet"), "stray": _stray(folder / "stray")}


def _scannet(folder: Path) -> Path:
    color, depth, _ = scene()
    _save(folder / "depth" / "0.png", depth)
    _save(folder / "color" / "0.jpg", cv2.resize(color, (2 * WIDTH, 2 * HEIGHT)))
    large = np.diag([2.0, 2.0, 1.0]) @ np.array(MATRIX)
    texts = {"intrinsic/intrinsic_depth": np.array(MATRIX), "intrinsic/intrinsic_color": large, "pose/0": np.eye(4)}
    texts |= {"intrinsic/extrinsic_depth": np.eye(4), "intrinsic/extrinsic_color": np.eye(4)}
    for name, matrix in texts.items():
        (folder / name).parent.mkdir(exist_ok=True)
        np.savetxt(folder / f"{name}.txt", matrix, fmt="%f")
    return folder


def _stray(folder: Path) -> Path:
    color, depth, _ = scene()
    _save(folder / "depth" / "000000.png", depth)
    video = cv2.VideoWriter(str(folder / "rgb.mp4"), cv2.VideoWriter_fourcc(*"mp4v"), 30, (2 * WIDTH, 2 * HEIGHT))
    video.write(cv2.resize(color, (2 * WIDTH, 2 * HEIGHT)))
    video.release()
    (folder / "camera_matrix.csv").write_text("120.0, 0.0, 63.5\n0.0, 120.0, 47.5\n0.0, 0.0, 1.0\n")
    (folder / "odometry.csv").write_text("timestamp, frame, x, y, z, qx, qy, qz, qw\n1.5, 000000, 0.1, 0.2, 0.3, 0, 0, 0, 1\n")
    return folder


def _files(folder: Path) -> dict[str, Path]:
    color, depth, mask = scene()
    rgb = color[..., ::-1]
    np.savez_compressed(
        folder / "arrays.npz", depth=np.stack([depth] * 2), color=np.stack([rgb] * 2), mask=mask, K=np.array(MATRIX),
        pose=np.eye(4), timestamps=np.arange(2.0), depth_scale=1000.0,
    )  # fmt: skip
    npy = folder / "npy"
    npy.mkdir()
    np.save(npy / "0_depth.npy", depth)
    np.save(npy / "0_color.npy", np.ascontiguousarray(rgb))
    (npy / "camera.yaml").write_text("fx: 60\nfy: 60\ncx: 31.5\ncy: 23.5\nwidth: 64\nheight: 48\n")
    record = folder / "record.r3d"
    try:
        import lzfse

        about = {"w": WIDTH, "h": HEIGHT, "dw": WIDTH, "dh": HEIGHT, "fps": 30, "K": [60, 0, 0, 0, 60, 0, 31.5, 23.5, 1]}
        about["poses"] = [[0, 0, 0, 1, 0, 0, 0]]
        with zipfile.ZipFile(record, "w") as archive:
            archive.writestr("metadata", json.dumps(about))
            archive.writestr("rgbd/0.depth", lzfse.compress((depth / 1000).astype("<f4").tobytes()))
            archive.writestr("rgbd/0.jpg", cv2.imencode(".jpg", color)[1].tobytes())
    except ImportError:
        pass
    return {"arrays.npz": folder / "arrays.npz", "npy": npy, "record.r3d": record}


def _clouds(folder: Path) -> dict[str, Path]:
    cloud = points()
    colors = np.full((len(cloud), 3), 120, np.uint8)
    rows = [" ".join(f"{value:.5f}" for value in point) + " 10 20 30" for point in cloud]
    head = f"ply\nformat {{}} 1.0\nelement vertex {len(cloud)}\n" + "".join(f"property float {axis}\n" for axis in "xyz")
    (folder / "a.xyz").write_text("# cloud\n" + "\n".join(rows))
    bare = "\n".join(row.rsplit(" ", 3)[0] for row in rows)
    (folder / "text.ply").write_text(head.format("ascii") + "end_header\n" + bare + "\n")
    (folder / "binary.ply").write_bytes(
        (head.format("binary_little_endian") + "end_header\n").encode() + cloud.astype("<f4").tobytes()
    )
    pcd = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {len(cloud)}\nHEIGHT 1\nVIEWPOINT 0 0 0.1 1 0 0 0\nPOINTS {len(cloud)}\nDATA "
    )
    (folder / "text.pcd").write_text(pcd + "ascii\n" + bare + "\n")
    (folder / "binary.pcd").write_bytes((pcd + "binary\n").encode() + cloud.astype("<f4").tobytes())
    np.savez_compressed(folder / "cloud.npz", points=cloud, colors=colors)
    try:
        from doo3d.inputs.support.open3d import open3d

        library = open3d()
        made = library.geometry.PointCloud(library.utility.Vector3dVector(cloud))
        library.io.write_point_cloud(str(folder / "packed.pcd"), made, compressed=True)
    except Exception as error:
        print(f"no compressed PCD: {error}")
    try:
        import laspy

        for name in ("a.las", "a.laz"):
            header = laspy.LasHeader(point_format=2, version="1.2")
            header.scales = [1e-4] * 3
            las = laspy.LasData(header)
            las.xyz = cloud
            las.red, las.green, las.blue = (colors[:, i].astype(np.uint16) * 257 for i in range(3))
            las.write(str(folder / name))
        import pye57

        file = pye57.E57(str(folder / "a.e57"), mode="w")
        names = ("cartesianX", "cartesianY", "cartesianZ")
        file.write_scan_raw(
            dict(zip(names, cloud.T.copy(), strict=True)), rotation=np.array([1.0, 0, 0, 0]), translation=np.ones(3)
        )
        file.close()
    except ImportError:
        pass
    names = ("a.xyz", "text.ply", "binary.ply", "text.pcd", "binary.pcd", "packed.pcd", "cloud.npz", "a.las", "a.laz", "a.e57")
    return {name: folder / name for name in names}


def _bags(folder: Path) -> dict[str, Path]:
    color, depth, _ = scene()
    made = {}
    for name, kind, packing in (
        ("plain.bag", "ros1", None), ("lz4.bag", "ros1", "lz4"), ("bz2.bag", "ros1", "bz2"), ("plain_db3", "sqlite3", None),
        ("mcap", "mcap", None), ("mcap_zstd", "mcap", "storage"), ("db3_zstd", "sqlite3", "message"),
    ):  # fmt: skip
        try:
            bag = BagScript(kind)
            bag.info("/camera/depth/camera_info", (WIDTH, HEIGHT), PINHOLE)
            bag.info("/camera/color/camera_info", (WIDTH, HEIGHT), PINHOLE)
            bag.tf("base", "camera_optical", (0, 0, 1), static=True)
            if packing:
                bag.packed("/camera/depth/image/compressedDepth", SECOND, packed_depth(depth), "16UC1; compressedDepth png")
                bag.packed("/camera/color/image/compressed", SECOND, png(color), "bgr8; png compressed bgr8")
            else:
                bag.image("/camera/depth/image", SECOND, depth, "16UC1")
                bag.image("/camera/color/image", SECOND, color, "bgr8", pad=3)
            made[name] = bag.write(folder / name, packing)
        except (ImportError, KeyError) as error:
            print(f"no {name}: {error!r}")
    cells = np.zeros(len(points()), [(axis, "<f4") for axis in "xyz"] + [("rgb", "<f4")])
    for i, axis in enumerate("xyz"):
        cells[axis] = points()[:, i]
    bag = BagScript("ros1")
    bag.cloud("/points", SECOND, cells)
    made["cloud.bag"] = bag.write(folder / "cloud.bag")
    return made


def _pictures(folder: Path) -> dict[str, Path]:
    color, _, mask = scene()
    made = {}
    for kind in ("png", "jpg", "tif", "bmp", "webp", "jp2", "gif", "avif", "exr"):
        path = folder / "pictures" / f"a_{kind}" / f"a.{kind}"
        with suppress(cv2.error, RuntimeError):
            _save(path, color.astype(np.float32) / 255 if kind == "exr" else color)
            made[f"picture a.{kind}"] = path
    _save(folder / "photos" / "a.jpg", color)
    _save(folder / "photos" / "mask" / "a.png", mask.astype(np.uint8) * 255)
    video = cv2.VideoWriter(str(folder / "a.avi"), cv2.VideoWriter_fourcc(*"MJPG"), 10, (WIDTH, HEIGHT))
    for i in range(3):
        video.write(scene(i / 5)[0])
    video.release()
    return {**made, "photos": folder / "photos", "a.avi": folder / "a.avi"}


def _texts(folder: Path) -> dict[str, Path]:
    """Write the files that have a reader of their own: results, a configuration, poses, cameras, truths."""
    from doo3d import Camera, Frame, detect, load_config
    from doo3d.outputs.detection_json import dumps
    from doo3d.viz.encoding import encode_png

    color, depth, mask = scene()
    frame = Frame(color[..., ::-1], (depth / 1000).astype(np.float32), Camera(*PINHOLE, WIDTH, HEIGHT), "a")
    detection = detect(frame, load_config(), mask)
    out = folder / "results"
    out.mkdir()
    (out / "a.json").write_text(dumps(detection.to_dict()))
    (out / "a.png").write_bytes(encode_png(detection, frame))
    frames = [{"name": "a", "status": "ok", "source": "a", "timestamp": 1.0, "seconds": 0.1, "picture": "png"}]
    source = {"path": str(folder / "open3d"), "format": "folder", "reading": {"depth_scale": 1000}}
    manifest = {"schema": "doo3d/manifest/1", "finished": True, "versions": {"doo3d": "0"}, "input": source, "frames": frames}
    (out / "manifest.json").write_text(json.dumps(manifest))
    line = {"name": "a", "status": "ok", "source": "a", "units": "m", "error": None, "code": None, "timestamp": 1.0}
    line |= {"seconds": 0.1, "occluded": 0.0, "lengths": [0.3], "radii": [0.004], "notes": [], "stages": {"read": 0.1}}
    line |= {"confidences": [0.9], "doubtful": [], "picture": "png", "evidence": {}}
    (out / "progress.jsonl").write_text((json.dumps(line) + "\n") * 2)
    (out / "config.yaml").write_text(load_config().to_yaml())
    (folder / "mine.yaml").write_text(load_config("default", {"merge.chains": 2}).to_yaml())
    (folder / "pose.json").write_text(json.dumps({"position": {"x": 0, "y": 0, "z": 1}, "orientation": [0, 0, 0, 1]}))
    (folder / "pose.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 0.5\n0 0 0 1\n")
    buffer = io.BytesIO()
    np.save(buffer, np.eye(4))
    (folder / "pose.npy").write_bytes(buffer.getvalue())
    (folder / "opencv.yaml").write_text(
        "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
        "   data: [ 60., 0., 31.5, 0., 60., 23.5, 0., 0., 1. ]\nimage_width: 64\nimage_height: 48\n"
    )
    (folder / "realsense.txt").write_text(
        'Intrinsic of "Depth" / 64x48 / {Z16}\n  Width: 64\n  Height: 48\n  PPX: 31.5\n  PPY: 23.5\n  Fx: 60\n  Fy: 60\n'
        "  Distortion: Brown Conrady\n  Coeffs: 0 0 0 0 0\n"
    )
    cable = {"axis": [[0, 0, 0.5], [0.1, 0, 0.5], [0.2, 0.05, 0.5]], "radius": 0.004, "closed": False, "color": [1, 2, 3]}
    (folder / "truth.json").write_text(json.dumps({"schema": "doo3d/truth/1", "frames": {"a": [cable]}}))
    (folder / "trajectory.txt").write_text(f"# poses\n1.0 {POSE_LINE}\n2.0 {POSE_LINE}\n")
    names = "results mine.yaml pose.json pose.txt pose.npy opencv.yaml realsense.txt truth.json trajectory.txt"
    return {f"text {name}": folder / name for name in names.split()}
