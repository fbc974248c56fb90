"""List depth, color and mask images in folders: in a sub-folder for each kind or in one folder, matched by name."""

from contextlib import suppress
from pathlib import Path

from ...errors import InputError
from ..formats.image_folder import Files
from ..read_options import ReadOptions, without_color
from .images import DEPTH_SUFFIXES, SUFFIXES, first_size
from .listing import Role, frame_key, images_in, is_depth_content, is_distance, match_images, may_be_depth, natural_key, role_of

COLOR_FOLDERS = ("color", "rgb", "image")  # these names come first, and then any with a word for color in it
_Parts = dict[str, Path | None]
"""Kind of image ("depth", "color", "mask") -> path; None if other frames have this kind but this one does not."""
_MIN_DEPTH_SHARE = 1 / 3  # of the images of a folder, if no name speaks of depth: a color image and a mask may belong to each


def is_depth_folder(folder: Path) -> bool:
    """Return whether a folder has a sub-folder of depth images, or contains depth images by name or content."""
    return _depth_folder(folder) is not None or bool(_side_by_side(folder).get("depth"))


def is_depth_file(file: Path) -> bool:
    """Return whether a file is a depth image: by its content, or as an image in a folder called depth.

    In such a folder, images with names or content of another kind do not count.
    """
    return file.suffix.lower() in DEPTH_SUFFIXES and (
        is_depth_content(file) or ("depth" in (role_of(file.stem), role_of(file.parent.name)) and may_be_depth(file))
    )


def list_frames(path: Path, options: ReadOptions, notes: list[str]) -> list[Files]:
    """Return the frames of a folder, or the one frame of a depth image, in natural order of their names; add to `notes`.

    Raises
    ------
    InputError : there are no depth images, or two for one frame, or the options give one color image for several.
    """
    root, frames = (path, _list_folder(path, notes)) if path.is_dir() else _list_file(path)
    if options.color is not None:
        if len(frames) > 1 and not without_color(options):
            sentence = (
                f"is one image, but there are {len(frames)} depth images: give color=none, or put the color images into color/"
            )
            raise InputError(f"--input-option color={options.color}: {sentence}", code="frame-count")
        color: _Parts = {} if without_color(options) else {"color": options.color.absolute()}
        frames = {name: {part: file for part, file in parts.items() if part != "color"} | color for name, parts in frames.items()}
    return [_files(root, name, parts) for name, parts in frames.items()]


def color_folder(folder: Path) -> Path:
    """Return the sub-folder of a folder that holds the color images; `folder`/color if there is none."""
    return _role_folder(folder, "color") or folder / COLOR_FOLDERS[0]


def _files(root: Path, name: str, parts: _Parts) -> Files:
    fault, mask = None, parts.get("mask")
    if (part := next((part for part, file in parts.items() if file is None), None)) is not None:
        place = color_folder(root) if part == "color" else root / part
        fault = (f"{place}: has no image for frame {name}", f"{part}-missing")
    return Files(name, parts["depth"], parts.get("color"), (mask,) if mask else (), fault=fault, root=root)


def _list_file(path: Path) -> tuple[Path, dict[str, _Parts]]:
    """Return the folder of the capture, and the frame of a single depth image with its color and mask in that folder."""
    found: list[tuple[Path, str, _Parts]] = [(path.parent, path.stem, {"depth": path})]
    for root in (path.parent, path.parent.parent):
        if root == path.parent or _depth_folder(root) == path.parent:
            with suppress(InputError):  # of other frames
                found += [(root, name, parts) for name, parts in _list_folder(root, []).items() if parts["depth"] == path]
    root, name, parts = max(found, key=lambda frame: (frame[2].get("color") is not None, frame is not found[0]))
    return root, {name: {part: file for part, file in parts.items() if file is not None}}


def _list_folder(path: Path, notes: list[str]) -> dict[str, _Parts]:
    """Return name of each frame -> its images by kind; None where only other frames have this kind."""
    folder, others = _depth_folder(path), dict[str, dict[str, Path]]()
    if folder is not None:
        depth = images_in(folder, DEPTH_SUFFIXES)
    else:
        images = _side_by_side(path)
        depth = images.pop("depth", {})
        if list(depth) == [""]:  # depth.png with color.png: there is nothing but the word to name the frame
            name = depth[""].stem
            images = {part: {name: file} for part, files in images.items() for file in list(files.values())[:1]}
            depth = {name: depth[""]}
        others = {part: files for part, files in images.items() if files}
    if not depth:
        raise InputError(f"{folder or path / 'depth'}: holds no depth images ({', '.join(DEPTH_SUFFIXES)})", code="folder-empty")
    for part in ("color", "mask"):
        beside = None if part in others else _namesake(folder or path, part) or _role_folder(path, part)
        if beside is not None and beside != folder:
            others[part] = match_images(images_in(beside, DEPTH_SUFFIXES), depth)
    if _of_another_size(depth, others):
        notes.append("depth is read alone: RealSense's Viewer does not align the color of a snapshot to its depth")
        del others["color"]
    if folder is not None and len(more := _depth_folders(path)) > 1:
        notes.append(f"of the folders of depth {folder.name} is read; give another one as the input: {', '.join(more[1:])}")
    if folder is None and others.get("color") and not set(depth) & set(others["color"]):
        like = next(iter(depth.values())).name
        notes.append(f"no color image has the name of a depth image, so depth is read alone: call them like {like}")
        del others["color"]
    names = set(depth) if folder is None else set(depth).union(*others.values())
    return {
        name: {part: files.get(name) for part, files in {"depth": depth, **others}.items()}
        for name in sorted(names, key=natural_key)
    }


def _depth_folder(path: Path) -> Path | None:
    """Return the sub-folder with the depth images: depth/, else one with depth in its name and a depth image in it."""
    return next((path / name for name in _depth_folders(path)), None)


def _depth_folders(path: Path) -> list[str]:
    """Return the names of the sub-folders with depth in their names and a depth image in them."""
    if (path / "depth").is_dir():
        return ["depth"]
    return [folder.name for folder in _sub_folders(path, "depth") if may_be_depth(_images_in(folder)[0])]


def _namesake(folder: Path, part: str) -> Path | None:
    """Return the folder of color images or masks of a depth folder, such as cam_high or cam_high_rgb for cam_high_depth."""
    folder = folder.absolute()
    name = frame_key(folder.name)
    if role_of(folder.name) != "depth" or not name:
        return None
    roles = (None, "color") if part == "color" else (part,)
    beside = [item for item in folder.parent.iterdir() if frame_key(item.name) == name and role_of(item.name) in roles]
    return next((item for item in sorted(beside) if item.is_dir() and _images_in(item)), None)


def _of_another_size(depth: dict[str, Path], others: dict[str, dict[str, Path]]) -> bool:
    """Return whether images are RealSense Viewer snapshots whose color and depth have different sizes."""
    files, color = list(depth.values()), list(others.get("color", {}).values())
    return bool(color) and files[0].suffix.lower() == ".raw" and first_size(files) != first_size(color)


def _images_in(folder: Path) -> list[Path]:
    return [file for file in folder.iterdir() if file.suffix.lower() in DEPTH_SUFFIXES and not file.name.startswith(".")]


def _role_folder(path: Path, role: str) -> Path | None:
    fixed = COLOR_FOLDERS if role == "color" else (role,)
    named = next((path / name for name in fixed if (path / name).is_dir()), None)
    return named or next(iter(_sub_folders(path, role)), None)


def _sub_folders(path: Path, role: str) -> list[Path]:
    """Return the sub-folders of images with words of a role in their names, shortest name first, distances last."""
    folders = [item for item in path.iterdir() if not item.name.startswith(".") and role_of(item.name) == role and item.is_dir()]
    return sorted(filter(_images_in, folders), key=lambda folder: (is_distance(folder), len(folder.name), folder.name))


def _side_by_side(path: Path) -> dict[str, dict[str, Path]]:
    """Return role -> frame -> image for the images directly in a folder; without "depth" if there are no depth images."""
    files = sorted((file for file in _images_in(path) if file.is_file()), key=lambda file: natural_key(file.name))
    roles: dict[Path, Role | None] = {file: role_of(file.stem) for file in files}
    depth = [file for file in files if roles[file] == "depth" and may_be_depth(file)]
    if not depth:
        is_named = role_of(path.absolute().name) == "depth"  # image_0.png in cam_high_depth
        depth = [file for file in files if (is_named or roles[file] is None) and is_depth_content(file)]
        if len(depth) < _MIN_DEPTH_SHARE * len(files):
            return {}
    depth = [file for file in depth if not is_distance(file)] or depth  # Replicator writes both
    of_depth = set(depth)
    rest = {file: role for file, role in roles.items() if file not in of_depth and file.suffix.lower() in (*SUFFIXES, ".npy")}
    colors = [file for file, role in rest.items() if role == "color"]
    if not colors:  # 000.jpg beside 000.png of 16 bits
        keys, plain = {frame_key(file.stem) for file in depth}, [file for file, role in rest.items() if role is None]
        colors = [file for file in plain if file.suffix.lower() != ".npy" and frame_key(file.stem) in keys]
    masks = [file for file, role in rest.items() if role == "mask"]
    return {"depth": _by_frame(path, depth), "color": _by_frame(path, colors), "mask": _by_frame(path, masks)}


def _by_frame(folder: Path, files: list[Path]) -> dict[str, Path]:
    by_frame: dict[str, Path] = {}
    for file in files:
        if (key := frame_key(file.stem)) in by_frame:
            names = f"{by_frame[key].name} and {file.name}"
            sentence = f"{names} are two images of one kind for frame {key or file.stem}: remove one"
            raise InputError(f"{folder}: {sentence}", code="names-clash")
        by_frame[key] = file
    return by_frame
