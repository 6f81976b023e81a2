"""Envelopes of OpenDaVINCI and OpenDLV, taken apart and made with the standard library alone."""

import collections
import struct

POINT_CLOUD = 49
MAGIC = b"\x0d\xa4"

Entry = collections.namedtuple("Entry", "kind payload sampled_us frame")


def varint(data, at):
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            return value, at


def fields(data):
    """The fields of a message: number, value."""
    at = 0
    while at < len(data):
        key, at = varint(data, at)
        if key & 7 == 0:
            value, at = varint(data, at)
        elif key & 7 == 2:
            length, at = varint(data, at)
            value, at = data[at : at + length], at + length
        else:
            length, code = {1: (8, "<d"), 5: (4, "<f")}[key & 7]
            value, at = struct.unpack(code, data[at : at + length])[0], at + length
        yield key >> 3, value


def unzigzag(value):
    return (value >> 1) ^ -(value & 1)


def as_varint(value):
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    out.append(value)
    return bytes(out)


def zigzag(value):
    return as_varint((value << 1) ^ (value >> 63))


def envelope(kind, payload, sampled_us, stamp=0):
    """A frame as libcluon puts it on the wire."""
    seconds, micros = divmod(sampled_us, 1_000_000)
    stamped = b"\x08" + zigzag(seconds) + b"\x10" + zigzag(micros)
    stamped = as_varint(len(stamped)) + stamped
    body = b"\x08" + zigzag(kind) + b"\x12" + as_varint(len(payload)) + payload
    body += b"\x1a" + stamped + b"\x22" + stamped + b"\x2a" + stamped + b"\x30" + as_varint(stamp)
    return MAGIC + struct.pack("<I", len(body))[:3] + body


def entries(recording):
    """The envelopes of a recording."""
    at = 0
    while at + 5 <= len(recording):
        end = at + 5 + (struct.unpack("<I", recording[at + 1 : at + 5])[0] >> 8)
        frame = recording[at:end]
        yield entry(frame)
        at = end


def entry(frame):
    parts = dict(fields(frame[5:]))
    sampled = dict(fields(parts.get(5, b"")))
    sampled_us = unzigzag(sampled.get(1, 0)) * 1_000_000 + unzigzag(sampled.get(2, 0))
    return Entry(unzigzag(parts[1]), parts.get(2, b""), sampled_us, frame)


def with_doubles(payload, changed):
    """A message of doubles and floats alone, some doubles of which another function of themselves takes the place of."""
    out, at = bytearray(payload), 0
    while at < len(payload):
        key, at = varint(payload, at)
        if key & 7 == 1:
            if key >> 3 in changed:
                value = struct.unpack_from("<d", payload, at)[0]
                struct.pack_into("<d", out, at, changed[key >> 3](value))
            at += 8
        else:
            at += 4
    return bytes(out)
