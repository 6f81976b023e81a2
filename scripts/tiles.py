"""Tiles of the occupancy grid, decoded and drawn with the standard library alone."""

import struct
import zlib

UNKNOWN = 7
# Tiles from another one within which a tile may lie.
FARTHEST = 500


def levels(tile):
    """Cells of a tile, row by row from the south-west: 0 free to 14 occupied, 7 unknown."""
    side, cells, run, shift = tile.cellsPerSide, [], 0, 0
    for byte in tile.cells:
        run |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            for _ in range(min(run >> 4, side * side + 1 - len(cells))):
                cells.append(((cells[-side] if len(cells) >= side else UNKNOWN) + run) % 16)
            run = shift = 0
    return cells


class Drawing:
    """A map as it comes in, tile by tile."""

    def __init__(self):
        self.map_id, self.rows, self.side, self.cell = None, {}, 0, 0.0

    def take(self, tile):
        """Adds a tile. Raises ValueError where it is of a map that has ended, or damaged."""
        is_new = self.map_id is None or 0 < (tile.mapId - self.map_id) % 2**32 < 2**31
        if not is_new and tile.mapId != self.map_id:
            raise ValueError(f"tile of map {tile.mapId}, which has ended; map {self.map_id} is drawn")
        if not (1 <= tile.cellsPerSide <= 1024 and 0.001 <= tile.cellSize <= 100):
            raise ValueError(f"a tile of {tile.cellsPerSide} cells of {tile.cellSize} m a side is impossible")
        if not is_new and (tile.cellsPerSide, tile.cellSize) != (self.side, self.cell):
            raise ValueError(f"a tile of {tile.cellsPerSide} cells of {tile.cellSize} m does not fit the map")
        if not is_new and not self.is_near(tile):
            raise ValueError(f"tile {tile.tileX}, {tile.tileY} is far from all others")
        if tile.encoding != 1:
            raise ValueError(f"encoding {tile.encoding} is unknown")
        checksum = zlib.crc32(bytes(tile.cells))
        if checksum != tile.checksum:
            raise ValueError(f"checksum of the cells is {checksum:08x}, not {tile.checksum:08x}")
        cells = levels(tile)
        if len(cells) != tile.cellsPerSide**2 or max(cells) > 14:
            raise ValueError(f"the cells do not fill a tile of {tile.cellsPerSide} cells a side")
        if is_new:
            self.map_id, self.rows = tile.mapId, {}
            self.side, self.cell = tile.cellsPerSide, tile.cellSize
        self.rows[tile.tileX, tile.tileY] = [
            cells[row * self.side : (row + 1) * self.side] for row in range(self.side)
        ]

    def is_near(self, tile):
        """Whether it lies within reach of the tiles that are there."""
        return any(
            abs(tile.tileX - x) < FARTHEST and abs(tile.tileY - y) < FARTHEST for x, y in self.rows
        )

    def image(self):
        """Rows from the north, cells from the west, and the south-west corner in metres."""
        xs, ys = zip(*self.rows) if self.rows else ((0,), (0,))
        blank = [[UNKNOWN] * self.side] * self.side
        image = []
        for y in range(max(ys), min(ys) - 1, -1):
            tiles = [self.rows.get((x, y), blank) for x in range(min(xs), max(xs) + 1)]
            for row in reversed(range(self.side)):
                image.append([level for tile in tiles for level in tile[row]])
        return image, (min(xs) * self.side * self.cell, min(ys) * self.side * self.cell)


def write_png(path, image):
    """A grey picture: white is free, black is occupied."""
    grey = bytes(255 - 255 * level // 14 for level in range(15))
    data = b"".join(b"\0" + bytes(grey[level] for level in row) for row in image)
    chunk = lambda kind, body: (
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    )
    head = struct.pack(">IIBBBBB", len(image[0]), len(image), 8, 0, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head))
        file.write(chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b""))
