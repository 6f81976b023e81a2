// What the service publishes, read from its own bytes: frames, envelopes, protobuf.

const u32 = "u32", s32 = "s32", f32 = "f32", f64 = "f64", bool = "bool", text = "text", bytes = "bytes";

// Fields by number, as in kreisel.proto.
const ENVELOPE = { 1: ["dataType", s32], 2: ["payload", bytes], 5: ["sampled", bytes] };
const TIME = { 1: ["seconds", s32], 2: ["microseconds", s32] };
const OBJECT = {
  1: ["id", u32], 2: ["classification", u32], 3: ["classProbability", f32], 4: ["existence", f32],
  5: ["measured", bool], 6: ["x", f64], 7: ["y", f64], 8: ["z", f64], 9: ["yaw", f32], 10: ["speed", f32],
  11: ["yawRate", f32], 13: ["length", f32], 14: ["width", f32], 15: ["height", f32],
  19: ["speedDeviation", f32], 20: ["age", f32], 22: ["points", u32],
};
const OBJECT_LIST = {
  1: ["revolution", u32], 2: ["frame", u32], 3: ["egoKnown", bool], 4: ["egoX", f64], 5: ["egoY", f64],
  6: ["egoZ", f64], 7: ["egoYaw", f32], 10: ["processingTime", f32], 11: ["objects", bytes],
};
const GRID_TILE = {
  1: ["mapId", u32], 4: ["tileX", s32], 5: ["tileY", s32], 6: ["side", u32], 7: ["cellSize", f64],
  8: ["encoding", u32], 10: ["cells", bytes], 11: ["anchorX", f64], 12: ["anchorY", f64], 13: ["anchorYaw", f64],
};
const STATUS = {
  1: ["uptime", f64], 2: ["received", u32], 3: ["published", u32], 4: ["refused", u32], 5: ["queueDropped", u32],
  7: ["kernelDropped", u32], 8: ["damaged", u32], 10: ["poses", u32], 11: ["faults", text],
  12: ["latencyMedian", f32], 13: ["latencyP99", f32], 14: ["latencyMax", f32], 15: ["sensor", text],
  16: ["columns", u32], 17: ["layers", u32], 18: ["rotationRate", f32], 19: ["byteOrder", text],
  20: ["byteOrderSource", text], 21: ["distanceUnit", f32], 23: ["groundHeight", f32], 28: ["healthy", bool],
  29: ["profile", text], 30: ["version", text], 32: ["odometry", text], 33: ["odometryDeviation", f32],
  34: ["odometryRestarts", u32], 35: ["poseSource", text], 36: ["poseDisagreement", f32], 37: ["poseJumps", u32],
  42: ["packets", u32], 43: ["packetsLost", u32], 45: ["returnMode", text], 46: ["sensorClock", text],
};

const ARM = {
  1: ["bearing", f32], 2: ["mayEnter", bool], 3: ["hindrance", u32], 4: ["hinderingObject", u32], 5: ["gap", f32],
  6: ["ownBegin", f32], 7: ["ownEnd", f32], 10: ["mayLeave", bool], 13: ["exitGap", f32], 14: ["exitBegin", f32],
  15: ["exitEnd", f32],
};
const WINDOW = {
  1: ["object", u32], 2: ["arm", u32], 4: ["begin", f32], 5: ["end", f32], 7: ["probability", f32], 9: ["atExit", bool],
};
const RING = { 1: ["kind", u32], 2: ["radius", f32], 3: ["width", f32] };
const ROUNDABOUT = {
  2: ["name", text], 3: ["x", f64], 4: ["y", f64], 5: ["diameter", f32], 6: ["state", u32], 7: ["ownArm", s32],
  8: ["arms", bytes], 9: ["windows", bytes], 11: ["rings", bytes], 12: ["confidence", f32],
};

const KINDS = {
  2021: ["list", OBJECT_LIST], 2022: ["tile", GRID_TILE], 2023: ["status", STATUS], 2024: ["roundabout", ROUNDABOUT],
};

// Lists within messages: their field and what they hold.
const LISTS = { list: { objects: OBJECT }, roundabout: { arms: ARM, windows: WINDOW, rings: RING } };

// A reader of varints and fixed numbers.
class Reader {
  constructor(array) {
    this.array = array;
    this.view = new DataView(array.buffer, array.byteOffset, array.byteLength);
    this.at = 0;
  }

  get isAtEnd() {
    return this.at >= this.array.length;
  }

  // Exact up to 2^53, which no counter reaches.
  varint() {
    let value = 0;
    for (let scale = 1; ; scale *= 128) {
      if (this.isAtEnd) throw new RangeError("a varint is cut off");
      const byte = this.array[this.at++];
      value += (byte & 127) * scale;
      if (byte < 128) return value;
    }
  }

  take(length) {
    if (this.at + length > this.array.length) throw new RangeError("a field is cut off");
    this.at += length;
    return this.array.subarray(this.at - length, this.at);
  }

  float(length) {
    const at = this.at;
    this.take(length);
    return length === 4 ? this.view.getFloat32(at, true) : this.view.getFloat64(at, true);
  }
}

// How a field of each kind is written.
const WIRES = { u32: 0, s32: 0, bool: 0, f64: 1, f32: 5, text: 2, bytes: 2 };

const isFalse = { u32: 0, s32: 0, f32: 0, f64: 0, bool: false, text: "", bytes: new Uint8Array() };

function decode(array, fields) {
  const message = {};
  for (const [name, kind] of Object.values(fields)) message[name] = isFalse[kind];
  const reader = new Reader(array);
  while (!reader.isAtEnd) {
    const key = reader.varint();
    const [name, kind] = fields[Math.floor(key / 8)] ?? [];
    const wire = key % 8;
    let value;
    if (wire === 0) value = reader.varint();
    else if (wire === 1) value = reader.float(8);
    else if (wire === 5) value = reader.float(4);
    else if (wire === 2) value = reader.take(reader.varint());
    else throw new RangeError(`wire type ${wire} is unknown`);
    // A field of another type than it should have is passed over, as an unknown one is.
    if (!name || wire !== WIRES[kind]) continue;
    if (kind === s32) value = value % 2 ? -(value + 1) / 2 : value / 2;
    else if (kind === bool) value = value !== 0;
    else if (kind === text) value = new TextDecoder().decode(value);
    message[name] = value;
  }
  return message;
}

function decodeList(array, fields) {
  const reader = new Reader(array);
  const items = [];
  while (!reader.isAtEnd) items.push(decode(reader.take(reader.varint()), fields));
  return items;
}

// The messages in a row of frames: `0D A4`, a 24-bit length, an envelope. A damaged one costs no other.
export function* messages(array) {
  for (let at = 0; at + 5 <= array.length && array[at] === 0x0d && array[at + 1] === 0xa4;) {
    const begin = at + 5;
    at = begin + (array[at + 2] | (array[at + 3] << 8) | (array[at + 4] << 16));
    const message = attempt(() => decodeEnvelope(array.subarray(begin, at)));
    if (message) yield message;
  }
}

function attempt(action) {
  try {
    return action();
  } catch (error) {
    if (error instanceof RangeError) return null;
    throw error;
  }
}

function decodeEnvelope(array) {
  const { dataType, sampled, payload } = decode(array, ENVELOPE);
  const [kind, fields] = KINDS[dataType] ?? [];
  if (!kind) return null;
  const { seconds, microseconds } = decode(sampled, TIME);
  const message = decode(payload, fields);
  for (const [name, items] of Object.entries(LISTS[kind] ?? {})) message[name] = decodeList(message[name], items);
  return { kind, time: seconds + microseconds / 1e6, message };
}

// A picture: heading, points, messages (the layout is in picture.rs).
export function readPicture(buffer) {
  const view = new DataView(buffer);
  const headingLength = view.getUint32(0, true);
  const heading = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, headingLength)));
  const count = view.getUint32(4 + headingLength, true);
  const begin = 8 + headingLength;
  const axis = (number) => new Int16Array(buffer.slice(begin + 2 * count * number, begin + 2 * count * (number + 1)));
  const bright = begin + 7 * count;
  const brightCount = view.getUint32(bright, true);
  const points = {
    count, x: axis(0), y: axis(1), z: axis(2),
    kind: new Uint8Array(buffer, begin + 6 * count, count),
    reflectivity: new Uint8Array(buffer, bright + 4, brightCount),
  };
  return { heading, points, messages: [...messages(new Uint8Array(buffer, bright + 4 + brightCount))] };
}

// Tiles of a daemon have as many cells a side.
const LARGEST_SIDE = 128;

// Levels of a tile's cells from 0 to 14, 7 is unknown, row by row from the south-west corner.
export function readCells({ encoding, side, cells }) {
  if (encoding !== 1 || side < 1 || side > LARGEST_SIDE) return null;
  const levels = new Uint8Array(side * side);
  const reader = new Reader(cells);
  for (let cell = 0; cell < levels.length;) {
    const run = attempt(() => reader.varint());
    if (run === null) return null;
    const end = cell + Math.floor(run / 16);
    if (end === cell || end > levels.length) return null;
    for (; cell < end; cell++) {
      const south = cell < side ? 7 : levels[cell - side];
      levels[cell] = (south + run) & 15;
    }
  }
  return levels;
}
