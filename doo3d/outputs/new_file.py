"""Name and write a single file made from a run, such as a report."""

from pathlib import Path

from ..errors import InputError
from .atomic import write_bytes, writing


def named_after(results: Path, suffix: str) -> Path:
    """Return the default path of a file made from a run: next to the run's folder, with the folder's name.

    results : the folder, such as out. suffix : suffix of the file, such as ".html".
    """
    folder = results.resolve() if results.name in ("", "..") else results
    return folder.with_name(folder.name + suffix)


def check_new_file(path: Path, force: bool, results: Path | None = None) -> None:
    """Check that a new file may be written at `path`; nothing is written.

    Parameters
    ----------
    path
        the file.
    force
        whether it may exist already.
    results
        folder of the run from which the file is made; an unchanged file made from this run before may be replaced.

    Raises
    ------
    InputError : `path` is a folder, its folder does not exist, or the file exists and may not be replaced.
    """
    from .products import Products

    if path.is_dir():
        raise InputError(f"{path}: is a folder, expected the name of a file to write", code="out-is-folder")
    if path.exists() and not force and not (results is not None and Products(results).are_unchanged(path)):
        raise InputError(
            f"{path}: exists already", code="out-exists", remedy="give another name with -o, or --force to replace it"
        )
    if not path.absolute().parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist: create it first", code="out-folder-missing")


def save(path: Path, content: str | bytes) -> None:
    """Write a text (as UTF-8) or bytes to the file `path`, replacing an existing file.

    Raises
    ------
    InputError : the file cannot be written.
    """
    with writing(path):
        write_bytes(path, content.encode("utf-8") if isinstance(content, str) else content)
