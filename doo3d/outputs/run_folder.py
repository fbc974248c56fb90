"""Write the folder of a run: the files of its frames, `config.yaml`, `manifest.json` and the journal."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from ..config import Config
from ..errors import InputError
from . import CONFIG, JOURNAL, MANIFEST, SUFFIXES
from .atomic import PREFIX, flush_to_disk, write_bytes, write_text
from .detection_json import dumps
from .folder_checks import check_writable, folder_aside, lies_in_input, move_aside, remove_files
from .input_state import InputState
from .journal import Journal
from .products import Products
from .resume import Line, file_checks, finished_frames
from .run_identity import changed_settings, find_conflict, frame_names, identity, read_manifest
from .run_lock import LOCK, RunLock
from .torn_manifest import TORN_NOTE, is_torn, restored_manifest, run_digests

KEPT_SECONDS = 60.0
"""Total time of all frames in s above which results are moved to another folder, not deleted, when settings change."""


class ResultsFolder:
    """The folder that a run writes its results to, frame after frame; an interrupted run resumes from it.

    The folder holds `<frame>.json` and, if wanted, `<frame>.jpg` for each frame, `config.yaml`, `manifest.json` (input, versions,
    outcome of each frame) and `progress.jsonl`, the journal with one line per finished frame. A frame is finished once its line
    is in the journal, which is written after its files. All files but the journal are the same, byte for byte, for the same
    input and configuration. Only one process writes to the folder: it is locked until `close`, or the end of a `with` block,
    which removes the lock, and the folder if it was made for this run and nothing was written.

    Parameters
    ----------
    path
        the folder.
    source
        description of the input for the manifest, with at least "path", "files" and "frames". If only "files" or "frames" differ
        from those of the results in the folder, the input has changed; any other difference means another input.
    config
        the configuration of the run.
    inputs
        the state of the input files, one entry in its `by_frame` per frame of the run, in order.
    restart
        whether to replace results of the same input in the folder. If false, results of the same input, configuration and
        versions are resumed; those of another configuration are replaced with a note, or moved to a folder next to this one if
        they took more than KEPT_SECONDS; others raise InputError.
    force
        whether to write even if the folder has other content. Results of any other run are removed, other files stay.
    retry_failed
        whether to process all failed frames again; if false, only those whose files have changed.
    needed
        suffixes of files without which a frame is not finished, and is processed again.

    Attributes
    ----------
    path
        the folder.
    done
        frame name -> line in the journal, for the finished frames before the first unfinished one.
    later
        the same for the finished frames after it, whose ids may have to change: call `keep` or `add` for each.
    notes
        sentences for the user about earlier results in the folder.

    Raises
    ------
    InputError
        the folder has other content or results that `restart` and `force` do not replace, is inside the input, cannot be written
        to or is locked by another run, or a frame's name cannot be a file name.
    """

    def __init__(
        self,
        path: Path,
        source: dict[str, Any],
        config: Config,
        inputs: InputState,
        *,
        restart: bool = False,
        force: bool = False,
        retry_failed: bool = False,
        needed: Sequence[str] = (),
    ) -> None:
        self.path = path
        self.notes: list[str] = []
        self._config = config
        self._inputs = inputs
        self._identity = identity(source | {"files": inputs.digest()}, config)
        self._run = run_digests(self._identity)
        self._journal = Journal(path / JOURNAL)
        self._aside: Path | None = None
        self._early_failures: list[Line] = []
        self._unflushed: list[Path] = []
        self._started = self._repeats = False
        check_writable(path)
        if lies_in_input(path, Path(source["path"])):
            raise InputError(
                f"{path}: belongs to the input, results there could overwrite it",
                code="out-in-input",
                remedy="give another folder with -o",
            )
        self._created = [folder for folder in (path, *path.parents) if not folder.exists()]
        try:
            self._lock = RunLock(path)
        except OSError as error:
            self._remove_created()
            raise self._unwritable(error) from None
        try:
            self._resume(restart, force, retry_failed, needed)
        except BaseException:
            self.close()
            raise

    def _resume(self, restart: bool, force: bool, retry_failed: bool, needed: Sequence[str]) -> None:
        """Compare the run with the results in the folder, and find the finished frames."""
        manifest, lines = self._former_run()
        conflict = find_conflict(self.path, manifest, self._identity, self._inputs.digest_before(lines))
        if conflict and not (force or conflict.is_setting or (restart and conflict.can_restart)):
            raise InputError(
                f"{self.path}: {conflict.reason}",
                code=conflict.code,
                remedy="give another folder with -o, or "
                + ("--restart to replace them" if conflict.can_restart else "--force to write there nevertheless"),
            )
        if self._lock.former is not None:
            self.notes.append(f"a run of {self._lock.former} did not end by itself; its lock is taken over")
        self._is_other_input = conflict is not None and not conflict.can_restart
        self._replaces = conflict is not None or (restart and manifest is not None)
        self._former_names = frame_names(manifest, lines) if self._replaces else set()
        if conflict and conflict.is_setting:
            if sum(_seconds(line) for line in lines) > KEPT_SECONDS and not (restart or self.path.name.startswith(PREFIX)):
                self._aside = folder_aside(self.path, self._former_names)
            settings = changed_settings(self.path, self._config)
            named = f" ({settings})" if settings else ""
            fate = "replaced" if self._aside is None else f"kept in {self._aside}"
            self.notes.append(f"{self.path} has results with other settings{named}; they are {fate}")
        self.done, self.later = {}, {}
        if self._replaces or manifest is None:
            return
        self._sweep()
        retried = {line["name"] for line in lines if line["status"] != "ok" and (retry_failed or self._inputs.has_changed(line))}
        names = list(self._inputs.by_frame)
        finished = finished_frames(self.path, lines, names, lambda line: line["name"] in retried, needed)
        self.done, self.later = finished.leading, finished.later
        if count := len(retried - self.done.keys() - self.later.keys()):
            again = "1 failed frame is" if count == 1 else f"{count} failed frames are"
            self.notes.append(f"{again} tried again" + ("" if retry_failed else ": files of the input have changed"))
        self._repeats = [line["name"] for line in lines] != list(self.done)  # frames of other lines are written once more

    def _former_run(self) -> tuple[dict[str, Any] | None, list[Line]]:
        """Return manifest and journal lines of the results in the folder; a manifest cut off by a power failure is restored."""
        manifest, torn = read_manifest(self.path), is_torn(self.path)
        lines = self._journal.read() if manifest is not None or torn else []
        if torn:
            before = self._inputs.digest_before(lines)
            manifest = restored_manifest(self.path, lines, self._identity, before, self._config.to_yaml())
            self.notes += [TORN_NOTE] if manifest is not None else []
        return manifest, lines

    def __enter__(self) -> ResultsFolder:
        """Return the folder, which is unlocked at the end of the `with` block."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None) -> None:
        """Unlock the folder, also after an error."""
        self.close()

    def close(self) -> None:
        """Unlock the folder, and remove it if it was made for this run and is empty. Further calls do nothing."""
        self._lock.release()
        self._remove_created()

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
            suffix of a file -> content, such as {".json": b"...", ".jpg": b"..."}; None for a frame that failed.

        Raises
        ------
        InputError
            the disk is full or the folder may not be written to.
        """
        if files is None and self._replaces and not self._started:
            self._early_failures.append(line | {"inputs": self._inputs.of_frame(name), "run": self._run})
            return
        try:
            self._start()
            if files is None:
                remove_files(self.path, [name])
                line = line | {"inputs": self._inputs.of_frame(name)}
            else:
                for suffix, content in files.items():
                    self._write(self.file(name, suffix), content)
                for path in (self.file(name, suffix) for suffix in SUFFIXES.values() if suffix not in files):
                    if path.exists():  # of an earlier run
                        path.unlink()
                line = line | {"files": file_checks(files)}
            self._journal.add(line | {"run": self._run})
            self._lock.touch()
        except OSError as error:
            self._undo(name)
            raise self._unwritable(error) from None

    def keep(self, name: str) -> None:
        """Confirm the files of a frame in `later`, which are equal to those that this run would write.

        Raises
        ------
        InputError
            the disk is full or the folder may not be written to.
        """
        try:
            self._start()
            self._journal.add(self.later[name])
        except OSError as error:
            raise self._unwritable(error) from None

    def amend(self, name: str, line: dict[str, Any], files: dict[str, bytes]) -> None:
        """Write further files of a frame in `done` or `later`, then its new line in the journal.

        Parameters
        ----------
        name
            name of the frame.
        line
            the frame's line in the journal, as for `add`.
        files
            suffix of a file -> content, such as {".jpg": b"..."}.

        Raises
        ------
        InputError
            the disk is full or the folder may not be written to.
        """
        lines = self.done if name in self.done else self.later
        try:
            self._start()
            for suffix, content in files.items():
                self._write(self.file(name, suffix), content)
            lines[name] = lines[name] | line | {"files": lines[name].get("files", {}) | file_checks(files)}
            self._journal.add(lines[name])
        except OSError as error:
            raise self._unwritable(error) from None
        self._repeats = True

    def finish(self, values: dict[str, Any]) -> None:
        """Write the manifest of the finished run, and `config.yaml`.

        Parameters
        ----------
        values
            the entries "counts", "figures", "notes" and "frames" of the manifest. Input, configuration and versions are added.

        Raises
        ------
        InputError
            the disk is full or the folder may not be written to.
        """
        text = dumps(self._identity | {"finished": True} | values)
        try:
            if self._repeats:
                self._tidy_journal()
            flush_to_disk(self._unflushed)
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

    def _write(self, path: Path, content: bytes) -> None:
        """Write a file of a frame, which `finish` flushes to the disk.

        After a power failure before that, the checksum in the journal reveals an incomplete file, and its frame is processed
        again.
        """
        write_bytes(path, content, False)
        self._unflushed.append(path)

    def _remove_created(self) -> None:
        """Remove the folders made for this run that are empty."""
        with contextlib.suppress(OSError):
            for folder in self._created:
                folder.rmdir()

    def _sweep(self) -> None:
        """Remove temporary files of runs that were killed while they wrote."""
        with contextlib.suppress(OSError):
            for temporary in self.path.glob(f"{PREFIX}*.tmp"):
                temporary.unlink()

    def _tidy_journal(self) -> None:
        """Rewrite the journal with one line per frame, the last one, in the order of the capture."""
        lines = {line["name"]: line for line in self._journal.read()}
        self._journal.rewrite(lines[name] for name in self._inputs.by_frame if name in lines)

    def _unwritable(self, error: OSError) -> InputError:
        kept = "; finished frames are kept, repeat the same command to resume" if (self.path / JOURNAL).exists() else ""
        return InputError(f"{self.path}: cannot be written to ({error.strerror or error}){kept}", code="out-unwritable")

    def _start(self) -> None:
        """Create the folder, remove a former run's results, and write the manifest of an unfinished run."""
        if self._started:
            return
        self._sweep()
        if self._aside is not None:
            move_aside(self.path, self._former_names, self._aside)
        if self._replaces:
            remove_files(self.path, self._former_names)
            self._journal.remove()
        if self._is_other_input:
            Products(self.path).forget()
        # the manifest first: it marks the folder as this run's, also if the run is killed before its first frame
        write_text(
            self.path / MANIFEST,
            dumps(self._identity | {"finished": False, "counts": {}, "figures": {}, "notes": [], "frames": []}),
        )
        write_text(self.path / CONFIG, self._config.to_yaml())
        for line in self._early_failures:
            self._journal.add(line)
        self._started = True

    def _undo(self, name: str) -> None:
        """Remove an incomplete frame, and a just created folder without a complete one."""
        with contextlib.suppress(OSError):
            remove_files(self.path, [name])
            if self._created and not self._journal.read():
                for file in self.path.iterdir():
                    if file.name != LOCK:
                        file.unlink()


def _seconds(line: Line) -> float:
    """Return the processing time of a frame in s from its line in the journal; 0 if unknown."""
    seconds = line.get("seconds")
    return float(seconds) if isinstance(seconds, int | float) and math.isfinite(seconds) else 0.0
