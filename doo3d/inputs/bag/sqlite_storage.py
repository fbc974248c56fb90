"""The SQLite files of ROS 2 bags: a table of topics, a table of messages."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from .records import WANTED, Broken, Message, Place, Topic, normal

MAGIC = b"SQLite format 3\0"


class Db3:
    """One `.db3` file. A message's place is the number of its row."""

    def __init__(self, path: Path, number: int = 0) -> None:
        self.path, self.number = path, number
        self.topics: list[Topic] = []
        self.faults: list[str] = []
        # immutable: nothing is written beside the file; a journal that a killed recorder left has to be read, though
        immutable = int(not path.with_name(f"{path.name}-wal").exists())
        uri = f"{path.resolve().as_uri()}?mode=ro&immutable={immutable}"
        self._database = sqlite3.connect(uri, uri=True, check_same_thread=False)
        self._database.text_factory = lambda text: text.decode("utf-8", "replace")
        with suppress(sqlite3.Error):  # what is wrong, `scan` meets again
            self._database.execute("PRAGMA writable_schema = ON")  # else a file with fewer pages than it says is refused

    def close(self) -> None:
        """Let go of the file."""
        if hasattr(self, "_database"):
            self._database.close()

    __del__ = close

    def scan(self) -> Iterator[Message]:
        """All messages of the types that matter, in the order of the file; fills `topics` and `faults` meanwhile."""
        try:
            rows = self._database.execute("SELECT id, name, type, serialization_format FROM topics ORDER BY id").fetchall()
            topics = {row[0]: Topic(row[1], normal(row[2]), row[3]) for row in rows}
            self.topics.extend(topics.values())
            wanted = [number for number, topic in topics.items() if topic.kind in WANTED]
            marks = ",".join("?" * len(wanted))
            # by number and not by time: rows then come as they lie in the file, as far as it goes
            query = f"SELECT id, topic_id, timestamp, length(data) FROM messages WHERE +topic_id IN ({marks}) ORDER BY id"
            for number, topic, time, size in self._database.execute(query, wanted):
                yield Message(topics[topic], int(time), (self.number, -1, int(number), int(size or 0)))
        except (sqlite3.Error, TypeError, ValueError) as error:
            self.faults.append(f"is cut off or damaged ({error})")

    def read(self, place: Place, limit: int | None = None) -> bytes:
        """The bytes of a message, or the first `limit`; raises Broken."""
        what = "data" if limit is None else f"substr(data, 1, {int(limit)})"
        try:
            found = self._database.execute(f"SELECT {what} FROM messages WHERE id = ?", (place[2],)).fetchone()
        except sqlite3.Error as error:
            raise Broken(f"is cut off or damaged ({error})") from None
        if found is None or not isinstance(found[0], bytes):
            raise Broken(f"has no message {place[2]} any more")
        return found[0]
