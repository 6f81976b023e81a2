// The scene as seen from above or aslant, on a canvas: an orthographic camera, so that the ground stays a plane
// figure and the map is drawn by one transform.

const CLASSES = ["unclassified", "car", "cyclist", "pedestrian", "truck"];
const FIRST_CLUSTER = 2;
const FIRST_OBJECT = 128;

export const className = (object) => CLASSES[object.classification] ?? "unclassified";

export class Camera {
  constructor() {
    this.centre = { x: 0, y: 0, z: 0 };
    this.offset = { x: 0, y: 0 };
    this.yaw = 0;
    this.elevation = 0.95;
    this.pixelsPerMetre = 9;
  }

  // What lies to the right of the middle of `clear` is covered.
  resize(width, height, clear) {
    this.width = width;
    this.height = height;
    this.middle = clear / 2;
  }

  prepare() {
    this.cosine = Math.cos(this.yaw);
    this.sine = Math.sin(this.yaw);
    this.flat = Math.sin(this.elevation);
    this.upright = Math.cos(this.elevation);
  }

  // A place in the local frame to pixels.
  project(x, y, z) {
    const dx = x - this.centre.x - this.offset.x;
    const dy = y - this.centre.y - this.offset.y;
    const right = dx * this.cosine + dy * this.sine;
    const ahead = dy * this.cosine - dx * this.sine;
    return [
      this.middle + this.pixelsPerMetre * right,
      this.height / 2 - this.pixelsPerMetre * (ahead * this.flat + (z - this.centre.z) * this.upright),
    ];
  }

  // Makes metres at a height, from (x, y) and turned by yaw, the context's units.
  enterPlane(context, { x, y, yaw }, z) {
    const scale = this.pixelsPerMetre;
    const [left, top] = this.project(x, y, z);
    const turn = yaw - this.yaw;
    const cosine = Math.cos(turn), sine = Math.sin(turn);
    context.transform(
      scale * cosine, -scale * sine * this.flat, -scale * sine, -scale * cosine * this.flat, left, top);
  }

  pan(dx, dy) {
    const right = -dx / this.pixelsPerMetre;
    const ahead = dy / this.pixelsPerMetre / Math.max(this.flat, 0.2);
    this.offset.x += right * this.cosine - ahead * this.sine;
    this.offset.y += right * this.sine + ahead * this.cosine;
  }

  turn(dx, dy) {
    this.yaw -= dx * 0.006;
    this.elevation = Math.min(Math.PI / 2, Math.max(0.25, this.elevation + dy * 0.006));
  }

  zoom(factor) {
    this.pixelsPerMetre = Math.min(200, Math.max(1, this.pixelsPerMetre * factor));
  }
}

export function draw(context, camera, world, colours) {
  camera.prepare();
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.scale(world.ratio, world.ratio);
  context.fillStyle = colours.back;
  context.fillRect(0, 0, camera.width, camera.height);
  if (world.layers.map) drawMap(context, camera, world);
  if (world.roundabout) drawRoundabout(context, camera, world, colours);
  drawPath(context, camera, world, colours);
  if (world.layers.points) drawPoints(context, camera, world, colours);
  drawVehicle(context, camera, world, colours);
  if (world.layers.trails) drawTrails(context, camera, world, colours);
  world.labels = [];
  for (const object of world.objects) drawObject(context, camera, world, object, colours);
}

function drawMap(context, camera, world) {
  context.save();
  const { anchor } = world.map;
  camera.enterPlane(context, anchor, world.groundZ);
  const [dx, dy] = [camera.centre.x + camera.offset.x - anchor.x, camera.centre.y + camera.offset.y - anchor.y];
  const [cosine, sine] = [Math.cos(anchor.yaw), Math.sin(anchor.yaw)];
  const reach = (camera.width + camera.height) / camera.pixelsPerMetre / Math.max(camera.flat, 0.2);
  world.map.draw(context, [dx * cosine + dy * sine, dy * cosine - dx * sine], reach);
  context.restore();
}

// Lanes as rings, fainter where no map knows them; at each arm a bar of time, outward, a metre a second: green or red as one may enter, with the own window
// and everybody's beside it.
function drawRoundabout(context, camera, { roundabout, groundZ }, colours) {
  const { arms, windows, rings, diameter, ownArm, confidence } = roundabout;
  context.save();
  camera.enterPlane(context, { x: roundabout.x, y: roundabout.y, yaw: 0 }, groundZ);
  context.strokeStyle = colours.path;
  for (const { kind, radius, width } of rings) {
    context.globalAlpha = (kind === 0 ? 0.22 : 0.1) * (confidence || 1);
    context.lineWidth = width;
    context.beginPath();
    context.arc(0, 0, radius, 0, 2 * Math.PI);
    context.stroke();
  }
  context.globalAlpha = 1;
  const bar = (from, to, aside, colour) => {
    context.strokeStyle = colour;
    context.beginPath();
    context.moveTo(diameter / 2 + from, aside);
    context.lineTo(diameter / 2 + Math.min(to, 15), aside);
    context.stroke();
  };
  arms.forEach((arm, number) => {
    context.save();
    context.rotate(arm.bearing);
    // On the side on which one drives in, and on the one on which one drives out.
    const way = (atExit, mayGo, gap, own, aside) => {
      bar(0, gap, aside, mayGo ? colours.path : colours.stop);
      bar(...own, aside + 0.9, colours.vehicle);
      for (const window of windows.filter((window) => window.arm === number && window.atExit === atExit)) {
        context.globalAlpha = Math.max(0.2, window.probability);
        bar(window.begin, window.end, aside - 0.9, colours.p99);
      }
      context.globalAlpha = 1;
    };
    context.lineWidth = number === ownArm ? 0.8 : 0.4;
    if (arm.hindrance !== 3) way(false, arm.mayEnter, arm.gap, [arm.ownBegin, arm.ownEnd], 1.6);
    // Where nothing is crossed on the way out there is nothing to say.
    context.lineWidth = 0.4;
    if (arm.exitEnd > 0) way(true, arm.mayLeave, arm.exitGap, [arm.exitBegin, arm.exitEnd], -1.6);
    context.restore();
  });
  context.restore();
}

function drawPath(context, camera, world, colours) {
  context.strokeStyle = colours.path;
  context.lineWidth = 2;
  line(context, camera, world.path.map(([x, y]) => [x, y, world.groundZ]));
}

function line(context, camera, places) {
  context.beginPath();
  for (const [x, y, z] of places) context.lineTo(...camera.project(x, y, z));
  context.stroke();
}

function drawPoints(context, camera, { points, heading, layers }, colours) {
  if (!points) return;
  const isBright = layers.reflectivity && points.reflectivity.length > 0;
  const [east, north, up] = heading.origin_m;
  const size = Math.min(3, Math.max(1.4, camera.pixelsPerMetre * 0.12));
  let last = null;
  for (let point = 0; point < points.count; point++) {
    const colour = isBright ? brightness(points.reflectivity[point], colours) : colourOf(points.kind[point], colours);
    if (colour !== last) context.fillStyle = last = colour;
    const [left, top] = camera.project(
      east + points.x[point] / 100, north + points.y[point] / 100, up + points.z[point] / 100);
    context.fillRect(left - size / 2, top - size / 2, size, size);
  }
}

// From dark blue over green to red; what throws light back by itself stands out.
const BRIGHTNESS = Array.from({ length: 11 }, (_, tenth) => `hsl(${250 - 24 * tenth} 75% 52%)`);

const brightness = (value, colours) => (value > 100 ? colours.text : BRIGHTNESS[Math.round(value / 10)]);

function colourOf(kind, colours) {
  if (kind === 0) return colours.ground;
  if (kind < FIRST_CLUSTER) return colours.loose;
  if (kind < FIRST_OBJECT) return colours.clusters[kind % colours.clusters.length];
  return colours[CLASSES[kind - FIRST_OBJECT]] ?? colours.loose;
}

function drawVehicle(context, camera, { vehicle, heading, groundZ }, colours) {
  const [x, y] = heading ? heading.origin_m : [0, 0];
  const place = vehicle ?? { x, y, yaw: heading?.yaw_rad ?? Math.PI / 2 };
  context.save();
  camera.enterPlane(context, place, groundZ);
  context.fillStyle = colours.vehicle;
  context.beginPath();
  context.moveTo(2, 0);
  context.lineTo(-1.6, 1);
  context.lineTo(-1, 0);
  context.lineTo(-1.6, -1);
  context.fill();
  context.restore();
}

function drawTrails(context, camera, { trails, objects }, colours) {
  context.lineWidth = 1.5;
  for (const object of objects) {
    context.strokeStyle = colours[className(object)];
    context.globalAlpha = 0.6;
    line(context, camera, trails.get(object.id)?.places ?? []);
  }
  context.globalAlpha = 1;
}

const CORNERS = [[1, 1], [1, -1], [-1, -1], [-1, 1]];

function drawObject(context, camera, world, object, colours) {
  const cosine = Math.cos(object.yaw), sine = Math.sin(object.yaw);
  const corner = ([along, across], up) => {
    const [a, b] = [along * object.length / 2, across * object.width / 2];
    return camera.project(
      object.x + a * cosine - b * sine, object.y + a * sine + b * cosine, object.z + up * object.height / 2);
  };
  const low = CORNERS.map((place) => corner(place, -1));
  const high = CORNERS.map((place) => corner(place, 1));
  const isSelected = object.id === world.selected;
  context.strokeStyle = context.fillStyle = colours[className(object)];
  context.lineWidth = isSelected ? 3 : 1.5;
  context.setLineDash(object.measured ? [] : [5, 4]);
  context.beginPath();
  for (const side of [low, high]) {
    side.forEach(([x, y], number) => (number ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.closePath();
  }
  CORNERS.forEach((_, number) => {
    context.moveTo(...low[number]);
    context.lineTo(...high[number]);
  });
  const [front, ahead] = [0.5, 0.5 + Math.max(0.6, object.speed) / Math.max(object.length, 0.1)].map((share) =>
    camera.project(object.x + share * object.length * cosine, object.y + share * object.length * sine, object.z));
  context.moveTo(...front);
  context.lineTo(...ahead);
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = isSelected ? 0.3 : 0.12;
  context.beginPath();
  high.forEach(([x, y]) => context.lineTo(x, y));
  context.fill();
  context.globalAlpha = 1;

  const [left, top] = camera.project(object.x, object.y, object.z + object.height / 2);
  world.labels.push({ id: object.id, left, top });
  if (world.layers.labels || isSelected) {
    const speed = object.speed >= 0.5 ? ` ${object.speed.toFixed(1)} m/s` : "";
    const text = `${className(object)} ${object.id}${speed} ${Math.round(100 * object.existence)} %`;
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "center";
    context.lineWidth = 3;
    context.strokeStyle = colours.back;
    context.strokeText(text, left, top - 8);
    context.fillStyle = colours.text;
    context.fillText(text, left, top - 8);
  }
}
