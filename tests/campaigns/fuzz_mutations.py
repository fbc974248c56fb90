"""How the fuzzer changes a file: bits, ends, numbers of headers, pieces, and texts; half the checksums are mended."""

from __future__ import annotations

import io
import re
import struct
import zipfile
import zlib
from random import Random

EXTREMES = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x10000, 50_000_000, 1 << 24)
TOKENS = (
    "null", "[]", "{}", "-1", "0", "1e400", "-1e308", "1e308", "1e-308", "NaN", "Infinity", "9" * 5000, "9" * 400, "9999999999",
    "true", '"../../x"', '"a\\u0000b"', '"\\ud800"', "[1, [2]]", "[" * 2000, '{"a": ' * 300, "*a", "&a [*a]",
    "!!python/object:os.system {}",
    "2026-99-99", "0x" + "f" * 2000, "1:59:59:59", "'", '"', "\x00", "\xff", "nan", "inf", "1e5 1e5", "", "<<: *b", "- - - -",
    "? x",
)  # fmt: skip
_TEXT = re.compile(rb"[\x09\x0a\x0d\x20-\x7e]*")
_VALUE = re.compile(r'-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?|"[^"\n]{0,60}"|\btrue\b|\bfalse\b|\bnull\b|\w+')


def mutated(data: bytes, random: Random) -> bytes:
    """Return a file changed in one to four places."""
    if data.startswith(b"PK\x03\x04") and random.random() < 0.6:
        return _member_changed(data, random)
    is_text = _TEXT.fullmatch(data[:2000]) is not None and len(data) < 100_000
    for _ in range(random.choice((1, 1, 1, 2, 3, 4))):
        change = random.choice(_OF_TEXT if is_text and random.random() < 0.75 else _OF_BYTES)
        data = change(data, random)
    return _png_mended(data) if data.startswith(b"\x89PNG\r\n\x1a\n") and random.random() < 0.5 else data


def _flip(data: bytes, random: Random) -> bytes:
    changed = bytearray(data or b"\0")
    for _ in range(random.choice((1, 1, 4, 32))):
        changed[random.randrange(len(changed))] ^= 1 << random.randrange(8)
    return bytes(changed)


def _truncate(data: bytes, random: Random) -> bytes:
    return data[: random.randrange(len(data) + 1)]


def _number(data: bytes, random: Random) -> bytes:
    """Overwrite 1 to 8 bytes, in the first 400 most often, by an extreme number."""
    size = random.choice((1, 2, 4, 4, 4, 8))
    reach = min(len(data), 400) if random.random() < 0.7 else len(data)
    at = random.randrange(max(reach - size, 1))
    value = random.choice(EXTREMES) if random.random() < 0.8 else random.getrandbits(64)
    packed = struct.pack(random.choice("<>") + "Q", value if size == 8 else value & (1 << 8 * size) - 1)
    packed = packed[:size] if packed[-1:] == b"\0" and size < 8 else packed[-size:]
    return data[:at] + packed + data[at + size :]


def _double(data: bytes, random: Random) -> bytes:
    start = random.randrange(len(data) + 1)
    piece = data[start : start + random.choice((1, 4, 16, 100, 4000))]
    at = random.randrange(len(data) + 1)
    return data[:at] + piece * random.choice((1, 1, 2, 50)) + data[at:]


def _delete(data: bytes, random: Random) -> bytes:
    start = random.randrange(len(data) + 1)
    return data[:start] + data[start + random.choice((1, 2, 4, 30, 1000)) :]


def _insert(data: bytes, random: Random) -> bytes:
    at = random.randrange(len(data) + 1)
    return data[:at] + random.randbytes(random.choice((1, 4, 64))) + data[at:]


def _token(data: bytes, random: Random) -> bytes:
    """Replace a number, a text or a word by something else."""
    text = data.decode("utf-8", "replace")
    matches = list(_VALUE.finditer(text))
    if not matches:
        return data + random.choice(TOKENS).encode("utf-8", "replace")
    match = random.choice(matches)
    return (text[: match.start()] + random.choice(TOKENS) + text[match.end() :]).encode("utf-8", "replace")


def _swap(data: bytes, random: Random) -> bytes:
    """Replace a number, a text or a word by another one of the same file."""
    text = data.decode("utf-8", "replace")
    matches = list(_VALUE.finditer(text))
    if len(matches) < 2:
        return data
    match, other = random.sample(matches, 2)
    return (text[: match.start()] + other[0] + text[match.end() :]).encode("utf-8", "replace")


def _lines(data: bytes, random: Random) -> bytes:
    """Repeat, remove or move lines."""
    lines = data.splitlines(keepends=True) or [b""]
    at = random.randrange(len(lines))
    return b"".join(random.choice((lines[:at] + lines[at + 1 :], lines[:at] * 2 + lines[at:], lines[at:] + lines[:at])))


_OF_BYTES = (_flip, _truncate, _number, _number, _number, _double, _delete, _insert)
_OF_TEXT = (_token, _token, _token, _swap, _lines, _truncate, _delete)


def _member_changed(data: bytes, random: Random) -> bytes:
    """Change a member of a ZIP, and write the ZIP again with right checksums."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = random.choice(sorted(members))
    members[name] = mutated(members[name], random)
    if random.random() < 0.1:
        members["../" + name] = members.pop(name)
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for member, content in members.items():
            archive.writestr(member, content)
    return made.getvalue()


def _png_mended(data: bytes) -> bytes:
    """Return a PNG with right checksums, so that what was changed reaches the decoder."""
    parts, at = [data[:8]], 8
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        body = data[at + 4 : at + 8 + length]
        if at + 12 + length > len(data):
            break
        parts.append(data[at : at + 4] + body + struct.pack(">I", zlib.crc32(body)))
        at += 12 + length
    return b"".join([*parts, data[at:]])
