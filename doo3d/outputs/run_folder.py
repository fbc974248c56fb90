"""The folder of a run: its frames' files, `config.yaml`, `manifest.json` and the journal `progress.jsonl`."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from ..config import Config
from ..errors import InputError
from . import CONFIG, JOURNAL, MANIFEST, SUFFIXES
from .atomic import PREFIX, write_bytes, write_text
from .detection_json import dumps
from .journal import Journal
from .resume import finished_frames
from .run_identity import find_conflict, frame_names, identity, read_manifest


class ResultsFolder:
    """The folder that a run writes its results to, frame after frame; an interrupted run resumes from it.

    It holds `<frame>.json` and `<frame>.png` for each frame, `config.yaml`, `manifest.json` (input, versions, and outcome of each
    frame) and `progress.jsonl`, the journal with one line per finished frame. A frame counts as finished once its line is in the
    journal, which is written after its files. All files but the journal are the same, byte for byte, for the same input and
    configuration. The folder is not created before the first result. Only one process may write to it.

    Parameters
    ----------
    path
        the folder.
    source
        description of the input for the manifest, with at least "path", "files" and "frames". If only "files" or "frames" differ
        from those of the results in the folder, the input has changed; any other difference means another input.
    config
        the configuration of the run.
    names
        names of all frames of the run, in order.
    restart
        whether to replace results of the same input in the folder. If false, results of the same input, configuration and
        versions are resumed, and others raise InputError.
    force
        whether to write even if the folder has other content. Results of any other run are removed, other files stay.

    Attributes
    ----------
    path
        the folder.
    done
        frame name -> line in the journal, for the frames that an earlier run has finished: all of `names` before the first one
        that is not finished.

    Raises
    ------
    InputError
        the folder has other content or results that `restart` and `force` do not replace, lies in the input or cannot be
        written to, or a frame's name is used twice or cannot be a file name.
    """

    def __init__(
        self,
        path: Path,
        source: dict[str, Any],
        config: Config,
        names: Sequence[str],
        *,
        restart: bool = False,
        force: bool = False,
    ) -> None:
        self.path = path
        self._config = config
        self._identity = identity(source, config)
        self._journal = Journal(path / JOURNAL)
        self._created: list[Path] = []
        self._early_failures: list[dict[str, Any]] = []
        self._started = False
        _check_names(path, names)
        _check_writable(path)
        manifest = read_manifest(path)
        if manifest is None and path.is_dir() and Path(source["path"]) in (path.resolve(), *path.resolve().parents):
            raise InputError(
                f"{path}: belongs to the input, results there could overwrite it: give another folder with -o",
                code="out-in-input",
            )
        conflict = find_conflict(path, manifest, self._identity)
        if conflict and not (force or (restart and conflict.can_restart)):
            option = "--restart to replace them" if conflict.can_restart else "--force to write there nevertheless"
            raise InputError(f"{path}: {conflict.reason}: give another folder with -o, or {option}", code=conflict.code)
        lines = self._journal.read() if manifest is not None else []
        self._replaces = conflict is not None or (restart and manifest is not None)
        self._former_names = frame_names(manifest, lines) if self._replaces else set()
        self.done = {} if self._replaces else finished_frames(path, lines, names)

    def file(self, name: str, suffix: str) -> Path:
        """Return the path of a frame's file in the folder, from the name of the frame and a suffix such as ".json"."""
        return self.path / f"{name}{suffix}"

    def add(self, name: str, line: dict[str, Any], files: dict[str, bytes] | None) -> None:
        """Write the files of one frame, then its line in the journal.

        If `restart` or `force` replaces the results of an earlier run, those are removed only when a frame of this run succeeds.

        Parameters
        ----------
        name
            name of the frame.
        line
            the frame's line in the journal: a dict with at least "name" and "status".
        files
            suffix of a file -> content, such as {".json": b"...", ".png": b"..."}; None for a frame that failed.

        Raises
        ------
        InputError
            the disk is full or the folder may not be written to.
        """
        if files is None and self._replaces and not self._started:
            self._early_failures.append(line)
            return
        try:
            self._start()
            if files is None:
                _remove_files(self.path, [name])
            for suffix, content in (files or {}).items():
                write_bytes(self.file(name, suffix), content)
            self._journal.add(line)
        except OSError as error:
            self._undo(name)
            raise self._unwritable(error) from None

    def finish(self, values: dict[str, Any]) -> None:
        """Write the manifest of the finished run, and `config.yaml`.

        Parameters
        ----------
        values
            the entries "counts", "figures" and "frames" of the manifest. Input, configuration and versions are added.

        Raises
        ------
        InputError
            the disk is full or the folder may not be written to.
        """
        text = dumps(self._identity | {"finished": True} | values)
        try:
            write_text(self.path / CONFIG, self._config.to_yaml())
            write_text(self.path / MANIFEST, text)
        except OSError as error:
            raise self._unwritable(error) from None

    def abandon(self) -> None:
        """Remove the files of a run in which every frame failed.

        The manifest, the configuration and the journal are deleted, and the folders that the run created if they are then empty.
        Does nothing if the run has written nothing.
        """
        if not self._started:
            return
        with contextlib.suppress(OSError):
            for name in (JOURNAL, CONFIG, MANIFEST):
                (self.path / name).unlink(missing_ok=True)
            for folder in self._created:
                folder.rmdir()

    def _unwritable(self, error: OSError) -> InputError:
        kept = "; finished frames are kept, repeat the same command to resume" if self.path.exists() else ""
        return InputError(f"{self.path}: cannot be written to ({error.strerror or error}){kept}", code="out-unwritable")

    def _start(self) -> None:
        """Create the folder, remove a former run's results, and write the manifest of an unfinished run."""
        if self._started:
            return
        self._created = self._created or [folder for folder in (self.path, *self.path.parents) if not folder.exists()]
        self.path.mkdir(parents=True, exist_ok=True)
        for temporary in self.path.glob(f"{PREFIX}*.tmp"):
            temporary.unlink()
        if self._replaces:
            _remove_files(self.path, self._former_names)
            self._journal.remove()
        # the manifest first: it marks the folder as this run's, also if the run is killed before its first frame
        write_text(self.path / MANIFEST, dumps(self._identity | {"finished": False, "counts": {}, "figures": {}, "frames": []}))
        write_text(self.path / CONFIG, self._config.to_yaml())
        for line in self._early_failures:
            self._journal.add(line)
        self._started = True

    def _undo(self, name: str) -> None:
        """Remove an incomplete frame, and a just created folder without a complete one."""
        with contextlib.suppress(OSError):
            _remove_files(self.path, [name])
            if self._created and not self._journal.read():
                for file in self.path.iterdir():
                    file.unlink()
                for folder in self._created:
                    folder.rmdir()


def _check_names(path: Path, names: Sequence[str]) -> None:
    checked: set[str] = set()
    for name in names:
        if name in checked:
            raise InputError(
                f"two frames are called {name}: both would be written to {path / name}.json, rename one", code="frame-names-clash"
            )
        if f"{name}.json" == MANIFEST or not name or Path(name).name != name:
            raise InputError(
                f"a frame is called {name!r}: {path / name}.json cannot be its file, rename the frame", code="frame-name-invalid"
            )
        checked.add(name)


def _check_writable(path: Path) -> None:
    existing = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    if not existing.is_dir():
        raise InputError(f"{path}: {existing} is a file, expected a folder for the results", code="out-is-file")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise InputError(f"{path}: no permission to write in {existing}: give another folder with -o", code="out-unwritable")


def _remove_files(path: Path, names: Iterable[str]) -> None:
    for name in names:
        for suffix in SUFFIXES.values():
            (path / f"{name}{suffix}").unlink(missing_ok=True)
