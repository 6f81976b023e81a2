"""Point clouds of a recording, decoded with the standard library and numpy."""

import json
import pathlib
import struct
import subprocess

import numpy as np

from program import KREISEL

POINT_CLOUD = 49
ELEVATIONS = np.radians(np.arange(-15, 16, 2))


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


def envelopes(recording):
    """Message number, payload and length in bytes of every envelope of a recording."""
    at = 0
    while at + 5 <= len(recording):
        length = struct.unpack("<I", recording[at + 1 : at + 5])[0] >> 8
        envelope = dict(fields(recording[at + 5 : at + 5 + length]))
        at += 5 + length
        yield envelope[1] >> 1, envelope[2], 5 + length


def clouds(recording):
    """The point cloud messages of a recording, as dictionaries by field number."""
    for kind, payload, _ in envelopes(recording):
        if kind == POINT_CLOUD:
            yield dict(fields(payload))


def points(cloud, order):
    """x, y, z of a cloud as arrays [columns][16]."""
    distances = np.frombuffer(cloud[4], order).reshape(-1, 16) * 0.01
    azimuth = np.radians(np.linspace(cloud[1], cloud[2], len(distances)))[:, None]
    flat = distances * np.cos(ELEVATIONS)
    return flat * np.sin(azimuth), flat * np.cos(azimuth), distances * np.sin(ELEVATIONS)


def taken(path):
    """x, y, z of every cloud that the pipeline takes, as arrays [columns][16] in metres."""
    inspected = subprocess.run([KREISEL, "inspect", "--json", path], stdout=subprocess.PIPE)
    details = json.loads(inspected.stdout)["point_clouds"]
    for cloud, detail in zip(clouds(pathlib.Path(path).read_bytes()), details):
        if detail["refused"] is None:
            yield points(cloud, "<u2" if detail["byte_order"] == "little-endian" else ">u2")
