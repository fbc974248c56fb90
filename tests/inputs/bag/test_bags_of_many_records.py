"""Small bags of millions of records, endless tables, or gigabytes of content: what is read is bounded by counts."""

from __future__ import annotations

import bz2
import sqlite3
import struct
from contextlib import closing
from pathlib import Path

import pytest
from builders.errors import refused

from doo3d.inputs.bag import records
from doo3d.inputs.bag.index import Bag, TopicIndex
from doo3d.inputs.bag.mcap_storage import MAGIC as MCAP
from doo3d.inputs.bag.rosbag1_storage import MAGIC as ROSBAG1

pytest.importorskip("rosbags")
COUNT = 100_000  # of records, ten times as many as a small file may have


def indexed(path: Path) -> tuple[Bag, dict[str, TopicIndex]]:
    """Return a bag after its scan, closed, and what it found."""
    with closing(Bag(path)) as bag:
        return bag, bag.index()


def ros1(content: bytes) -> bytes:
    """A ROS 1 bag with one chunk."""
    return ROSBAG1 + ros1_record(content, op=b"\x05", compression=b"bz2", size=struct.pack("<I", len(content)))


def ros1_record(data: bytes, **fields: bytes) -> bytes:
    head = b"".join(
        struct.pack("<I", len(name) + 1 + len(value)) + name.encode() + b"=" + value for name, value in fields.items()
    )
    data = bz2.compress(data) if "compression" in fields else data
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data


def text(words: bytes) -> bytes:
    return struct.pack("<I", len(words)) + words


def mcap(content: bytes) -> bytes:
    """An MCAP file with one chunk, compressed by lz4."""
    import lz4.frame

    data = lz4.frame.compress(content)
    head = struct.pack("<QQQI", 0, 0, len(content), 0) + text(b"lz4") + struct.pack("<Q", len(data))
    return MCAP + mcap_record(1, text(b"") * 2) + mcap_record(6, head + data) + mcap_record(15, bytes(4))


def mcap_record(op: int, data: bytes) -> bytes:
    return bytes([op]) + struct.pack("<Q", len(data)) + data


def mcap_topic(number: int) -> bytes:
    return mcap_record(4, struct.pack("<HH", number, 1) + text(b"/depth%d" % number) + text(b"cdr") + text(b""))


SCHEMA = mcap_record(3, struct.pack("<H", 1) + text(b"sensor_msgs/msg/Image") + text(b"ros2msg") + text(b""))
MESSAGE = mcap_record(5, struct.pack("<HIQQ", 0, 0, 0, 0) + struct.pack("<IIII", 0x100, 1, 2, 1) + bytes(4))
CONNECTION = ros1_record(text(b"type=sensor_msgs/Image"), op=b"\x07", conn=bytes(4), topic=b"/depth")
ROS1_MESSAGE = ros1_record(bytes(16), op=b"\x02", conn=bytes(4), time=bytes(8))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.mcap", lambda: mcap(SCHEMA + mcap_topic(0) + MESSAGE * COUNT)),
        ("a.mcap", lambda: mcap(mcap_record(1, b"") * COUNT)),
        ("a.bag", lambda: ros1(CONNECTION + ROS1_MESSAGE * COUNT)),
    ],
)
def test_millions_of_records_in_a_small_file(tmp_path, name, content):
    (tmp_path / name).write_bytes(content())
    bag, indices = indexed(tmp_path / name)
    bound = records._FREE_RECORDS + bag.storages[0].size // records._MIN_RECORD_BYTES
    assert sum(len(index) for index in indices.values()) <= bound < COUNT
    assert any("records, too many for its size" in fault for fault in bag.faults())
    assert len(bag.faults()) <= records._MAX_FAULTS


def test_more_topics_than_any_robot_has(tmp_path):
    (tmp_path / "a.mcap").write_bytes(mcap(SCHEMA + b"".join(map(mcap_topic, range(records._MAX_TOPICS + 1)))))
    bag, _ = indexed(tmp_path / "a.mcap")
    assert len(bag.topics) == records._MAX_TOPICS
    assert "declares more than" in bag.faults()[0]


def test_a_tail_of_zeros_is_no_record(tmp_path):
    (tmp_path / "a.bag").write_bytes(ros1(CONNECTION) + bytes(1 << 20))
    bag, _ = indexed(tmp_path / "a.bag")
    assert bag.storages[0]._records == 2
    assert "there is no valid record" in bag.faults()[0]


def test_chunks_that_unpack_out_of_proportion(tmp_path, monkeypatch):
    monkeypatch.setattr(records, "_FREE_BYTES", 1 << 20)
    chunk = ros1(CONNECTION + ros1_record(bytes(1 << 20), op=b"\x00")).removeprefix(ROSBAG1)
    (tmp_path / "a.bag").write_bytes(ROSBAG1 + chunk * 20)
    bag, _ = indexed(tmp_path / "a.bag")
    assert "unpacks to more than" in bag.faults()[0]


# --- SQLite ------------------------------------------------------------------------------------------------------------

TOPICS = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format);"
TOPIC = "INSERT INTO topics VALUES(1, '/depth', 'sensor_msgs/msg/Image', 'cdr');"
MESSAGES = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data);"
NUMBERS = "WITH RECURSIVE c(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM c)"
ENDLESS = {
    "messages in a view": f"{TOPICS}{TOPIC}CREATE VIEW messages AS {NUMBERS} SELECT id, 1 topic_id, 0 timestamp, '' data FROM c",
    "topics in a view": MESSAGES + f"CREATE VIEW topics AS {NUMBERS} SELECT id, '' name, '' type, '' serialization_format FROM c",
    "a computed column": TOPICS + TOPIC + MESSAGES.replace("data", "data AS (zeroblob(1000000000))"),
    "a virtual table": TOPICS + TOPIC + "CREATE VIRTUAL TABLE messages USING fts5(topic_id, timestamp, data)",
}


@pytest.mark.parametrize("name", ENDLESS)
def test_only_plain_tables_are_read(tmp_path, name):
    database = sqlite3.connect(tmp_path / "a.db3")
    try:
        database.executescript(ENDLESS[name])
    except sqlite3.OperationalError as error:
        pytest.skip(f"this SQLite: {error}")
    finally:
        database.close()
    refused(tmp_path / "a.db3", "bag-damaged", "has no plain table")


def test_a_table_whose_pages_repeat_has_no_more_rows_than_its_file(tmp_path):
    """The page of the table's root lists one leaf again and again, a thousandfold in each of its levels."""
    database = sqlite3.connect(tmp_path / "a.db3")
    database.executescript("PRAGMA page_size = 4096;" + TOPICS + TOPIC + MESSAGES)
    database.executemany("INSERT INTO messages VALUES(?, 1, 0, x'00')", ((i,) for i in range(1, 20_000)))
    database.commit()
    root = database.execute("SELECT rootpage FROM sqlite_master WHERE name = 'messages'").fetchone()[0]
    database.close()
    data = bytearray((tmp_path / "a.db3").read_bytes())
    start = 4096 * (root - 1)
    assert data[start] == 5  # an inner page: its cells begin with the page's number
    cells = [struct.unpack_from(">H", data, start + 12 + 2 * i)[0] for i in range(struct.unpack_from(">H", data, start + 3)[0])]
    for cell in cells:
        data[start + cell : start + cell + 4] = data[start + cells[0] : start + cells[0] + 4]
    (tmp_path / "a.db3").write_bytes(data)
    rows = sum(len(index) for index in Bag(tmp_path / "a.db3").index().values())
    assert rows <= records._FREE_RECORDS + len(data) // records._MIN_RECORD_BYTES


def test_a_query_ends_after_the_steps_that_a_file_needs(tmp_path, monkeypatch):
    database = sqlite3.connect(tmp_path / "a.db3")
    database.executescript(TOPICS + TOPIC + MESSAGES)
    database.executemany("INSERT INTO messages VALUES(?, 2, 0, x'00')", ((i,) for i in range(1, 50_000)))
    database.commit()
    database.close()
    bag, _ = indexed(tmp_path / "a.db3")
    assert not bag.faults()
    from doo3d.inputs.bag import sqlite_storage

    monkeypatch.setattr(sqlite_storage, "_FREE_STEPS", 0)
    monkeypatch.setattr(sqlite_storage, "_STEPS_PER_BYTE", 0)
    bag, _ = indexed(tmp_path / "a.db3")
    assert "interrupted" in bag.faults()[0]
