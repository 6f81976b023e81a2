// The occupancy grid, put together from its tiles as any subscriber would.

import { readCells } from "./wire.js";

const UNKNOWN = 7;
// More than a daemon keeps around the sensor; the ones that were not renewed for longest go.
const MOST_TILES = 2000;
// A map whose tiles stay away for so long is not the one that is kept.
const SILENCE_MS = 2000;

export class GridMap {
  constructor() {
    this.clear();
  }

  clear() {
    this.mapId = null;
    this.anchor = { x: 0, y: 0, yaw: 0 };
    this.tiles = new Map();
  }

  take(tile, colours) {
    const now = performance.now();
    // Ids are compared as they wrap; a daemon that was started anew may begin with an older one.
    const isOlder = this.mapId !== null && ((tile.mapId - this.mapId) | 0) < 0;
    if (isOlder && now - this.heard < SILENCE_MS) return;
    const levels = readCells(tile);
    if (!levels) return;
    if (tile.mapId !== this.mapId) {
      this.clear();
      this.mapId = tile.mapId;
    }
    this.heard = now;
    this.anchor = { x: tile.anchorX, y: tile.anchorY, yaw: tile.anchorYaw };
    const key = `${tile.tileX} ${tile.tileY}`;
    const known = this.tiles.get(key) ?? { canvas: document.createElement("canvas") };
    Object.assign(known, {
      levels, side: tile.side,
      metres: tile.side * tile.cellSize,
      west: tile.tileX * tile.side * tile.cellSize,
      south: tile.tileY * tile.side * tile.cellSize,
    });
    this.tiles.delete(key);
    this.tiles.set(key, known);
    if (this.tiles.size > MOST_TILES) this.tiles.delete(this.tiles.keys().next().value);
    paint(known, colours);
  }

  repaint(colours) {
    for (const tile of this.tiles.values()) paint(tile, colours);
  }

  // Draws the tiles within a reach of a place; the context's units are metres of the odometry frame, y to the north.
  draw(context, [x, y], reach) {
    context.imageSmoothingEnabled = false;
    const isNear = ({ west, south, metres }) =>
      Math.abs(west - x) < reach + metres && Math.abs(south - y) < reach + metres;
    for (const { canvas, west, south, metres } of [...this.tiles.values()].filter(isNear)) {
      context.save();
      context.transform(1, 0, 0, -1, west, south + metres);
      context.drawImage(canvas, 0, 0, metres, metres);
      context.restore();
    }
  }
}

// One pixel a cell, north up: what is unknown is left out, and what is sure is strong.
function paint({ canvas, levels, side }, { free, occupied }) {
  canvas.width = canvas.height = side;
  const context = canvas.getContext("2d");
  const image = context.createImageData(side, side);
  levels.forEach((level, cell) => {
    const row = side - 1 - Math.floor(cell / side);
    const pixel = 4 * (row * side + (cell % side));
    const sureness = Math.abs(level - UNKNOWN) / UNKNOWN;
    const colour = level < UNKNOWN ? free : occupied;
    image.data.set([...colour.slice(0, 3), 255 * colour[3] * sureness], pixel);
  });
  context.putImageData(image, 0, 0);
}
