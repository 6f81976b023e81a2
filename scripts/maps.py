"""Compares the occupancy grid, as a subscriber receives it, with the simulator's truth."""

import collections
import json
import math
import pathlib
import types

import numpy as np
from scipy.ndimage import binary_dilation, distance_transform_edt

from envelopes import entries, fields, unzigzag
from tiles import UNKNOWN, levels

OBJECT_LIST, GRID_TILE = 2021, 2022
OCCUPIED, SEEN, PASSED = 1, 2, 4
MOVING_MPS = 0.5
LATE_JOIN_S = 10
REACH_M = 50
# A shorter way does not tell how a frame is turned.
LEAST_WAY_M = 5


def revolutions(recording):
    """For each object list of a recording, the tiles that follow it and the bytes that they take."""
    tiles, size = None, 0
    for entry in entries(recording):
        if entry.kind == OBJECT_LIST:
            if tiles is not None:
                yield tiles, size
            tiles, size = [], 0
        elif entry.kind == GRID_TILE and tiles is not None:
            size += len(entry.frame)
            field = dict(fields(entry.payload))
            place = (unzigzag(field[4]), unzigzag(field[5]))
            tiles.append((place, types.SimpleNamespace(cellsPerSide=field[6], cellSize=field[7], cells=field[10])))
    yield tiles, size


def within(boxes, x, y, margin):
    """Which places lie in one of the boxes."""
    inside = np.zeros(np.shape(x), bool)
    for user in boxes:
        dx, dy = x - user["x"], y - user["y"]
        cosine, sine = math.cos(user["yaw"]), math.sin(user["yaw"])
        along, across = np.abs(dx * cosine + dy * sine), np.abs(dy * cosine - dx * sine)
        inside |= (along <= user["l"] / 2 + margin) & (across <= user["w"] / 2 + margin)
    return inside


class Apart:
    """How the frame of a map is turned and moved against that of the truth."""

    def __init__(self, turn=0.0, shift=(0.0, 0.0)):
        self.turn, self.shift = turn, np.array(shift)

    @classmethod
    def along(cls, trajectory, truth):
        """From the vehicle's way in both (Umeyama 1991): without poses the frame begins elsewhere, and drifts."""
        found = np.loadtxt(trajectory)[:, 1:3]
        true = np.array([[line["ego"]["x"], line["ego"]["y"]] for line in truth[: len(found)]])
        got, wanted = found - found.mean(0), true - true.mean(0)
        turn = math.atan2(np.sum(got[:, 0] * wanted[:, 1] - got[:, 1] * wanted[:, 0]), np.sum(got * wanted))
        if np.ptp(true, axis=0).max() < LEAST_WAY_M:
            turn = 0.0
        cosine, sine = math.cos(turn), math.sin(turn)
        return cls(turn, true.mean(0) - np.array([[cosine, -sine], [sine, cosine]]) @ found.mean(0))

    def on_cells(self, grid, shape, origin, cell):
        """A map's probabilities on the cells of the truth, not a number outside of the map."""
        found = grid["probability"]
        row, column = np.indices(shape)
        x = origin[0] + (column + 0.5) * cell - self.shift[0]
        y = origin[1] + (row + 0.5) * cell - self.shift[1]
        cosine, sine = math.cos(self.turn), math.sin(self.turn)
        column = np.floor((cosine * x + sine * y - grid["origin"][0]) / cell).astype(int)
        row = np.floor((cosine * y - sine * x - grid["origin"][1]) / cell).astype(int)
        known = (0 <= row) & (row < found.shape[0]) & (0 <= column) & (column < found.shape[1])
        result = np.full(shape, np.nan, found.dtype)
        result[known] = found[row[known], column[known]]
        return result


def static_scores(grid_path, true_path, truth, apart):
    """Recall, precision and free space in percent within 10 and 50 m of the vehicle's path."""
    with np.load(grid_path) as grid, np.load(true_path) as true:
        cell, bits, origin = float(grid["cell"]), true["cells"], true["origin"]
        found = apart.on_cells(grid, bits.shape, origin, cell)
    off_path = np.ones(found.shape, bool)
    for line in truth:
        column, row = (int((line["ego"][axis] - origin[n]) / cell) for n, axis in enumerate("xy"))
        if 0 <= row < off_path.shape[0] and 0 <= column < off_path.shape[1]:
            off_path[row, column] = False
    distance = distance_transform_edt(off_path) * cell
    tolerant = lambda cells: binary_dilation(cells, np.ones((3, 3), bool))
    stands, occupied = bits & OCCUPIED > 0, found > 0.5
    near_standing = tolerant(stands)
    scores = {}
    for reach in [10, 50]:
        near = (distance <= reach) & np.isfinite(found)
        wanted, got = stands & (bits & SEEN > 0) & near, occupied & near
        free = (bits & PASSED > 0) & ~near_standing & near
        scores[f"occupied cells found within {reach} m, %"] = 100 * np.mean(tolerant(occupied)[wanted])
        scores[f"occupied cells right within {reach} m, %"] = 100 * np.mean(near_standing[got])
        scores[f"free cells found within {reach} m, %"] = 100 * np.mean(found[free] < 0.5)
    return scores


class Subscriber:
    """Keeps the map that the tiles make."""

    def __init__(self):
        self.tiles, self.side, self.cell = {}, 64, 0.1

    def take(self, tiles):
        for place, tile in tiles:
            cells = np.array(levels(tile), np.int8)
            self.side, self.cell = tile.cellsPerSide, tile.cellSize
            self.tiles[place] = cells.reshape(self.side, self.side) - UNKNOWN

    def occupied(self, columns, rows):
        out = np.zeros(len(columns), bool)
        for n, (column, row) in enumerate(zip(columns, rows)):
            tile = self.tiles.get((column // self.side, row // self.side))
            out[n] = tile is not None and tile[row % self.side, column % self.side] > 0
        return out

    def near(self, x, y):
        """Tiles whose middle lies within the grid's reach."""
        width = self.side * self.cell
        return {
            place
            for place in self.tiles
            if math.hypot((place[0] + 0.5) * width - x, (place[1] + 0.5) * width - y) < REACH_M
        }


def stream_scores(recording, truth, true_path):
    """What a subscriber sees: trails, bytes a second, and how soon a late one has the map."""
    with np.load(true_path) as true:
        bits, origin, cell = true["cells"], true["origin"], float(true["cell"])
    everyone, late = Subscriber(), Subscriber()
    sizes, left, marked, joined = [], 0, 0, math.nan
    for number, (tiles, size) in enumerate(revolutions(pathlib.Path(recording).read_bytes())):
        everyone.take(tiles)
        sizes.append(size)
        users = truth[number]["objects"]
        if number > 20:
            # Cells that it left one second ago.
            for user in truth[number - 11]["objects"]:
                if abs(user["v"]) < MOVING_MPS or user["points"] < 5:
                    continue
                radius = user["l"] / 2
                columns, rows = np.meshgrid(
                    *(np.arange(int((user[a] - radius) / cell), int((user[a] + radius) / cell) + 1) for a in "xy")
                )
                columns, rows = columns.ravel(), rows.ravel()
                x, y = (columns + 0.5) * cell, (rows + 0.5) * cell
                column = ((x - origin[0]) / cell).astype(int).clip(0, bits.shape[1] - 1)
                row = ((y - origin[1]) / cell).astype(int).clip(0, bits.shape[0] - 1)
                over = within([user], x, y, 0) & (bits[row, column] & OCCUPIED == 0)
                for later in [truth[number - 10]["objects"], users]:
                    over &= ~within(later, x, y, 0.05)
                left += np.sum(over)
                marked += np.sum(everyone.occupied(columns[over], rows[over]))
        if number >= 10 * LATE_JOIN_S and math.isnan(joined):
            ego = truth[number]["ego"]
            late.take(tiles)
            if everyone.near(ego["x"], ego["y"]) <= set(late.tiles):
                joined = (number - 10 * LATE_JOIN_S + 1) / 10
    return {
        "cells of a moving object's way occupied 1 s later, %": 100 * marked / max(left, 1),
        "late subscriber has the whole map after, s": joined,
        "kB/s of tiles": np.mean(sizes[10:]) / 100,
    }


def scores(run, folder, scenario, seed, duration, config, without_poses):
    """All scores of one scenario and seed."""
    stem = folder / f"map-{scenario}-{seed}"
    rec, truth, true = (stem.with_suffix(s) for s in [".rec", ".truth.jsonl", ".true.npz"])
    out, grid = stem.with_suffix(".out.rec"), stem.with_suffix(".npz")
    simulated = ["simulate", scenario, "--seed", seed, "--duration", duration]
    run(*simulated, "--output", rec, "--truth", truth, "--grid", true)
    way = stem.with_suffix(".tum")
    run("process", rec, "--output", out, "--grid", grid, "--trajectory", way, "--config", config)
    with open(truth) as file:
        lines = [json.loads(line) for line in file]
    apart = Apart.along(way, lines) if without_poses else Apart()
    result = static_scores(grid, true, lines, apart) | stream_scores(out, lines, true)
    for path in [rec, out]:
        path.unlink()
    return result


def mean_by_name(results):
    """Means of every score over several results."""
    values = collections.defaultdict(list)
    for result in results:
        for name, value in result.items():
            values[name].append(value)
    return {name: float(np.mean(of)) for name, of in values.items()}
