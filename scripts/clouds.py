"""Point clouds of a recording, decoded with the standard library and numpy."""

import json
import pathlib
import subprocess

import numpy as np

from envelopes import POINT_CLOUD, entries, fields
from program import KREISEL

ELEVATIONS = np.radians(np.arange(-15, 16, 2))


def clouds(recording):
    """The point cloud messages of a recording, as dictionaries by field number."""
    for entry in entries(recording):
        if entry.kind == POINT_CLOUD:
            yield dict(fields(entry.payload))


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
