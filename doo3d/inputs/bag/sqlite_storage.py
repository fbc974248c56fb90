"""Read SQLite files of ROS 2 bags: a table of topics, a table of messages."""

from __future__ import annotations

import sqlite3
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from .records import READ_TYPES, DamagedRecord, Message, MessageLocation, Storage, Topic, ros2_type

MAGIC = b"SQLite format 3\0"
_STEPS_AT_ONCE = 100_000  # of SQLite's virtual machine between two looks at their number: some milliseconds
_FREE_STEPS, _STEPS_PER_BYTE = 10_000_000, 4  # of a query: a second, and twice the steps for a row in its least bytes


class Db3(Storage):
    """An open SQLite file (`.db3`) of a ROS 2 bag: `scan` lists its messages, `read` returns the bytes of one.

    The location of a message is (number of the file in the bag, -1, `id` in the table `messages`, length in bytes).
    """

    def __init__(self, path: Path, number: int = 0) -> None:
        super().__init__(path, number)
        # immutable: SQLite writes nothing beside the file; not if a killed recorder left a journal, which has to be read
        immutable = int(not path.with_name(f"{path.name}-wal").exists())
        uri = f"{path.resolve().as_uri()}?mode=ro&immutable={immutable}"
        self._database = sqlite3.connect(uri, uri=True, check_same_thread=False)
        if sys.version_info >= (3, 11):  # what a row announces is refused before memory is taken
            self._database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, min(self.size, 2**31 - 1))
        self._database.text_factory = lambda text: text.decode("utf-8", "replace")
        self._steps = 0
        self._database.set_progress_handler(self._is_too_long, _STEPS_AT_ONCE)
        with suppress(sqlite3.Error):  # `scan` meets the same error and reports it
            self._database.execute("PRAGMA writable_schema = ON")  # else SQLite refuses a file with fewer pages than declared

    def _is_too_long(self) -> bool:
        """Return whether a query took more steps than a table of the file's size needs; SQLite then aborts it."""
        self._steps += _STEPS_AT_ONCE
        return self._steps > _FREE_STEPS + _STEPS_PER_BYTE * self.size

    def _execute(self, query: str, values: Sequence[object] = ()) -> sqlite3.Cursor:
        self._steps = 0
        return self._database.execute(query, values)

    def _check_tables(self) -> None:
        """Raise DamagedRecord unless topics and messages are plain tables, since views and computed columns may never end."""
        for name in ("topics", "messages"):
            kinds = self._execute("SELECT type, rootpage > 0 FROM sqlite_master WHERE lower(name) = ?", (name,)).fetchall()
            columns = self._execute("SELECT hidden FROM pragma_table_xinfo(?)", (name,)).fetchall()
            if kinds != [("table", 1)] or any(hidden for (hidden,) in columns):
                raise DamagedRecord(f"has no plain table {name}")

    def close(self) -> None:
        """Close the file."""
        if hasattr(self, "_database"):
            self._database.close()

    __del__ = close

    def scan(self) -> Iterator[Message]:
        """Yield the messages of the types that doo3d reads; see Storage."""
        try:
            self._check_tables()
            rows = self._execute("SELECT id, name, type, serialization_format FROM topics ORDER BY id").fetchall()
            topics = {row[0]: Topic(row[1], ros2_type(row[2]), row[3]) for row in rows}
            self.topics.extend(topics.values())
            numbers = [number for number, topic in topics.items() if topic.kind in READ_TYPES]
            marks = ",".join("?" * len(numbers))
            # by row number, not by time: rows then come in file order, up to the damage
            query = f"SELECT id, topic_id, timestamp, length(data) FROM messages WHERE +topic_id IN ({marks}) ORDER BY id"
            for number, topic, time, size in self._execute(query, numbers):
                self.count_record()
                yield Message(topics[topic], int(time), (self.number, -1, int(number), int(size or 0)))
        except DamagedRecord as error:
            self.faults.append(str(error))
        except (sqlite3.Error, TypeError, ValueError) as error:
            self.faults.append(f"is cut off or damaged ({error})")

    def read(self, location: MessageLocation, limit: int | None = None) -> bytes:
        """Return the bytes of one message; see Storage."""
        if location[3] > self.size:
            raise DamagedRecord(f"announces {location[3]} bytes for message {location[2]}, more than the file has")
        column = "data" if limit is None else f"substr(data, 1, {int(limit)})"
        try:
            row = self._execute(f"SELECT {column} FROM messages WHERE id = ?", (location[2],)).fetchone()
        except sqlite3.Error as error:
            raise DamagedRecord(f"is cut off or damaged ({error})") from None
        if row is None or not isinstance(row[0], bytes):
            raise DamagedRecord(f"has no message {location[2]} any more")
        return row[0]
