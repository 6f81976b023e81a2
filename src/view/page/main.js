// The page: takes pictures, keeps what they say, draws it.

import { readPicture } from "./wire.js";
import { GridMap } from "./map.js";
import { Camera, className, draw } from "./scene.js";
import { LatencyLine, showObject, showStatus, showSteps } from "./panel.js";

const TRAIL_S = 5;
const MOST_PLACES = 100;
const HISTORY = 600;
const MOST_HISTORIES = 1000;
const SILENCE_MS = 1500;
const RECONNECT_MS = 1000;

const byId = (id) => document.getElementById(id);
const canvas = byId("scene");
const context = canvas.getContext("2d");
const camera = new Camera();

// All that is known; the tests of the page read it, too.
const world = {
  map: new GridMap(), layers: { map: true, points: true, reflectivity: false, trails: true, labels: true },
  objects: [], labels: [], ratio: 1, pictures: 0, connected: false, selected: null, heard: 0,
};
window.kreisel = world;

let latency, colours, socket, arrivals;
let isSeeking = false;

function forget() {
  world.map.clear();
  Object.assign(world, {
    objects: [], trails: new Map(), histories: new Map(), path: [], points: null, heading: null, vehicle: null,
    groundZ: 0, status: null, run: 0, time: null, roundabout: null,
  });
  latency = new LatencyLine();
  arrivals = [];
}

function readColours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(`--${name}`).trim();
  const channels = (name) => of(name).split(/[\s,]+/).map(Number);
  const names = ["back", "text", "faint", "ground", "loose", "path", "vehicle", "median", "p99", "stop",
    "car", "cyclist", "pedestrian", "truck", "unclassified"];
  colours = Object.fromEntries(names.map((name) => [name, of(name)]));
  colours.clusters = of("clusters").split(",").map((colour) => colour.trim());
  colours.free = channels("free");
  colours.occupied = channels("occupied");
  world.map.repaint(colours);
}

function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/pictures`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    forget();
    world.connected = true;
    say("waiting for a revolution");
  };
  socket.onmessage = ({ data }) => take(readPicture(data));
  socket.onclose = () => {
    world.connected = false;
    say("not connected: trying again");
    setTimeout(connect, RECONNECT_MS);
  };
}

function say(text) {
  byId("notice").textContent = text;
  byId("notice").hidden = !text;
}

const ask = (control) => socket.readyState === WebSocket.OPEN && socket.send(JSON.stringify(control));

function take({ heading, points, messages }) {
  if (heading.player && heading.player.run !== world.run) {
    forget();
    world.run = heading.player.run;
  }
  const now = performance.now();
  let isNew = false;
  for (const { kind, message, time } of messages) {
    if (kind === "tile") world.map.take(message, colours);
    else if (kind === "status") world.status = message;
    else if (kind === "list" && time !== world.time) {
      isNew = true;
      world.roundabout = null;
      takeList(message, time, now);
    } else if (kind === "roundabout" && time === world.time) world.roundabout = message;
  }
  Object.assign(world, { heading, points, heard: now });
  const [, , up] = heading.origin_m;
  world.groundZ = up - heading.ground_below_m;
  camera.centre = { x: heading.origin_m[0], y: heading.origin_m[1], z: world.groundZ };
  if (isNew) {
    world.pictures++;
    arrivals.push(now);
    const { path } = world, [x, y] = heading.origin_m, last = path.at(-1);
    if (!last || Math.hypot(x - last[0], y - last[1]) > 0.5) path.push([x, y]);
    if (path.length > 4000) path.shift();
  }
  byId("reflectivity").hidden = !points.reflectivity.length;
  say("");
  showPlayer(heading.player);
  redraw();
}

function takeList(list, time, now) {
  if (time < world.time) {
    world.histories.clear();
    world.trails.clear();
  }
  world.vehicle = list.egoKnown ? { x: list.egoX, y: list.egoY, yaw: list.egoYaw } : null;
  world.objects = list.objects;
  world.time = time;
  latency.take(list.processingTime, now);
  for (const object of list.objects) {
    const history = world.histories.get(object.id) ?? { states: [] };
    history.latest = object;
    history.time = time;
    history.states.push({ speed: object.speed, existence: object.existence, classProbability: object.classProbability });
    if (history.states.length > HISTORY) history.states.shift();
    world.histories.set(object.id, history);
    const trail = world.trails.get(object.id) ?? { places: [], times: [] };
    trail.places.push([object.x, object.y, object.z]);
    trail.times.push(time);
    while (trail.times[0] < time - TRAIL_S || trail.times.length > MOST_PLACES) {
      trail.places.shift();
      trail.times.shift();
    }
    world.trails.set(object.id, trail);
  }
  const excess = world.histories.size - MOST_HISTORIES;
  const isStale = ([id, history], number) =>
    number < excess || (time - history.time > TRAIL_S && id !== world.selected);
  for (const [id] of [...world.histories].filter(isStale)) {
    world.histories.delete(id);
    world.trails.delete(id);
  }
}

let isDue = false;

function redraw() {
  if (isDue) return;
  isDue = true;
  requestAnimationFrame(() => {
    isDue = false;
    draw(context, camera, world, colours);
    showScale();
  });
}

// The figures change more slowly than the scene.
function showFigures() {
  const now = performance.now();
  arrivals = arrivals.filter((arrival) => now - arrival < 3000);
  const silence = now - world.heard;
  if (world.connected && world.pictures > 0 && silence > SILENCE_MS) {
    say(`no revolution for ${Math.floor(silence / 1000)} s`);
  }
  const rate = arrivals.length > 1 ? 1000 * (arrivals.length - 1) / (arrivals.at(-1) - arrivals[0]) : 0;
  if (world.status) showStatus(world.status, rate);
  if (world.heading) showSteps(world.heading.steps_ms);
  latency.draw(colours);
  const counts = {};
  for (const object of world.objects) counts[className(object)] = (counts[className(object)] ?? 0) + 1;
  for (const entry of document.querySelectorAll("#legend [data-class]")) {
    entry.querySelector("b").textContent = counts[entry.dataset.class] ?? 0;
  }
  const object = world.objects.find(({ id }) => id === world.selected);
  showObject(object, world.histories.get(world.selected), colours);
}

function showScale() {
  const metres = [1, 2, 5, 10, 20, 50].find((length) => length * camera.pixelsPerMetre > 60) ?? 100;
  byId("scale").style.width = `${metres * camera.pixelsPerMetre}px`;
  byId("scale").textContent = `${metres} m`;
  byId("north").style.transform = `rotate(${camera.yaw}rad)`;
}

function showPlayer(player) {
  byId("player").hidden = !player;
  if (!player) return;
  byId("play").textContent = player.is_playing ? "Pause" : "Play";
  byId("play").dataset.playing = player.is_playing;
  const seek = byId("seek");
  seek.max = player.duration_s;
  if (!isSeeking) seek.value = player.at_s;
  byId("at").textContent = `${player.at_s.toFixed(1)} of ${player.duration_s.toFixed(1)} s`;
  byId("speed").value = String(player.speed);
}

function resize() {
  world.ratio = Math.min(2, window.devicePixelRatio);
  const { clientWidth, clientHeight } = canvas;
  [canvas.width, canvas.height] = [clientWidth * world.ratio, clientHeight * world.ratio];
  const isBeside = byId("panel").offsetHeight > 0 && clientWidth > 800;
  camera.resize(clientWidth, clientHeight, clientWidth - (isBeside ? byId("panel").offsetWidth : 0));
  redraw();
}

// Drag to move, with the right button or two fingers to turn, wheel or pinch to zoom, click to choose.
function listen() {
  const pointers = new Map();
  let moved = 0;
  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
    moved = 0;
  };
  canvas.onpointermove = (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const [dx, dy] = [event.clientX - last.clientX, event.clientY - last.clientY];
    moved += Math.abs(dx) + Math.abs(dy);
    if (pointers.size === 2) {
      const other = [...pointers.values()].find(({ pointerId }) => pointerId !== event.pointerId);
      const apart = (pointer) => Math.hypot(pointer.clientX - other.clientX, pointer.clientY - other.clientY);
      camera.zoom(apart(event) / Math.max(1, apart(last)));
      camera.turn(dx / 2, dy / 2);
    } else if (event.buttons === 2 || event.shiftKey) camera.turn(dx, dy);
    else camera.pan(dx, dy);
    pointers.set(event.pointerId, event);
    redraw();
  };
  canvas.onpointerup = canvas.onpointercancel = (event) => {
    pointers.delete(event.pointerId);
    if (event.type === "pointerup" && moved < 5) choose(event.offsetX, event.offsetY);
  };
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(-0.0015 * event.deltaY));
    redraw();
  }, { passive: false });
  for (const box of document.querySelectorAll("[data-layer]")) {
    box.onchange = () => {
      world.layers[box.dataset.layer] = box.checked;
      redraw();
    };
  }
  byId("centre").onclick = () => {
    camera.offset = { x: 0, y: 0 };
    camera.yaw = 0;
    redraw();
  };
  byId("above").onclick = () => {
    camera.elevation = camera.elevation > 1.5 ? 0.95 : Math.PI / 2;
    redraw();
  };
  byId("menu").onclick = () => document.body.classList.toggle("open");
  byId("play").onclick = () => ask({ play: byId("play").dataset.playing !== "true" });
  byId("back").onclick = () => ask({ step: -1 });
  byId("on").onclick = () => ask({ step: 1 });
  byId("speed").onchange = () => ask({ speed: Number(byId("speed").value) });
  byId("seek").oninput = () => (isSeeking = true);
  byId("seek").onchange = () => {
    isSeeking = false;
    ask({ seek: Number(byId("seek").value) });
  };
  matchMedia("(prefers-color-scheme: dark)").onchange = () => {
    readColours();
    redraw();
  };
  window.onresize = resize;
}

const REACH_PIXELS = 30;

function choose(left, top) {
  const apart = (label) => Math.hypot(label.left - left, label.top - top);
  const nearest = world.labels.reduce((best, label) => (best && apart(best) < apart(label) ? best : label), null);
  world.selected = nearest && apart(nearest) < REACH_PIXELS ? nearest.id : null;
  if (world.selected !== null) document.body.classList.add("open");
  showFigures();
  redraw();
}

forget();
readColours();
listen();
resize();
connect();
setInterval(showFigures, 250);
