// Figures beside the scene: rates, latency, steps, losses, what was detected, and one object's history.

import { className } from "./scene.js";

const byId = (id) => document.getElementById(id);
const ms = (seconds) => `${(1000 * seconds).toFixed(2)} ms`;

export function showStatus(status, rate) {
  const table = {
    "revolutions a second": rate.toFixed(1),
    "revolutions answered": `${status.published} of ${status.received}`,
  };
  if (status.latencyMedian > 0) {
    table["latency, median"] = ms(status.latencyMedian);
    table["latency, 99 %"] = ms(status.latencyP99);
    table["latency, longest"] = ms(status.latencyMax);
  }
  fill("rates", table);

  const losses = Object.fromEntries(
    status.faults.split(" ").filter(Boolean).map((fault) => {
      const [name, count] = fault.split("=");
      return [name.replaceAll("_", " "), count];
    }));
  if (status.queueDropped) losses["dropped: behind"] = status.queueDropped;
  if (status.kernelDropped) losses["dropped: buffer full"] = status.kernelDropped;
  if (status.packetsLost) losses["packets lost"] = status.packetsLost;
  if (status.damaged) losses["damaged datagrams"] = status.damaged;
  fill("losses", Object.keys(losses).length ? losses : { none: "" });

  const detected = {};
  if (status.sensor) {
    detected.sensor = `${status.sensor}, ${status.columns} x ${status.layers}`;
    detected.rotation = `${status.rotationRate.toFixed(1)} Hz`;
    detected["byte order"] = `${status.byteOrder} (${status.byteOrderSource})`;
    detected["distance unit"] = `${(1000 * status.distanceUnit).toFixed(0)} mm`;
    detected["sensor height"] = `${status.groundHeight.toFixed(2)} m`;
    if (status.packets) {
      detected.returns = status.returnMode;
      detected["sensor's clock"] = status.sensorClock;
    }
    detected.odometry = status.odometry;
    detected["pose source"] = status.poseSource;
    if (status.poseSource !== "none") detected["poses and odometry apart"] = `${status.poseDisagreement.toFixed(2)} m`;
  }
  detected.profile = status.profile;
  detected.version = status.version;
  fill("detected", detected);
}

function fill(id, table) {
  const rows = Object.entries(table).map(([name, value]) => {
    const row = document.createElement("tr");
    for (const content of [name, value]) row.appendChild(document.createElement("td")).textContent = content;
    return row;
  });
  byId(id).replaceChildren(...rows);
}

// Shares of the steps in the last revolution's time.
export function showSteps(steps) {
  const whole = steps.reduce((sum, [, took]) => sum + took, 0);
  const parts = steps.map(([name, took], number) => {
    const part = document.createElement("span");
    part.style.flexGrow = Math.max(took, 0.001);
    part.className = `step step-${number % 6}`;
    part.textContent = took > 0.12 * whole ? name : "";
    part.title = `${name}: ${took.toFixed(2)} ms`;
    return part;
  });
  byId("steps").replaceChildren(...parts);
  byId("steps-sum").textContent = whole ? `${whole.toFixed(2)} ms a revolution` : "";
}

// Median and 99th percentile of each second of the last minute.
export class LatencyLine {
  constructor() {
    this.seconds = [];
    this.current = [];
    this.second = null;
  }

  take(processingTime, now) {
    const second = Math.floor(now / 1000);
    if (this.second !== null && second !== this.second && this.current.length) {
      const sorted = this.current.sort((a, b) => a - b);
      const at = (share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
      this.seconds.push([at(0.5), at(0.99)]);
      this.seconds = this.seconds.slice(-60);
      this.current = [];
    }
    this.second = second;
    this.current.push(1000 * processingTime);
  }

  draw(colours) {
    const lines = [[colours.p99, 1], [colours.median, 0]].map(([colour, number]) => ({
      colour, values: this.seconds.map((second) => second[number]),
    }));
    plot(byId("latency"), lines, { low: 0, unit: "ms", colours });
  }
}

// Draws lines that share a scale, with the greatest value written beside them.
function plot(canvas, lines, { low, high, unit, colours }) {
  const ratio = window.devicePixelRatio;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (!width) return;
  [canvas.width, canvas.height] = [width * ratio, height * ratio];
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  const top = high ?? Math.max(1e-3, ...lines.flatMap(({ values }) => values));
  for (const { colour, values } of lines) {
    context.strokeStyle = colour;
    context.lineWidth = 1.5;
    context.beginPath();
    values.forEach((value, number) => {
      const x = width * (values.length > 1 ? number / (values.length - 1) : 1);
      context.lineTo(x, height - 2 - (height - 4) * (value - low) / (top - low));
    });
    context.stroke();
  }
  context.fillStyle = colours.faint;
  context.font = "11px system-ui, sans-serif";
  context.fillText(`${top.toFixed(top < 10 ? 1 : 0)} ${unit}`, 2, 11);
}

// One object and its history.
export function showObject(object, history, colours) {
  byId("object").hidden = !history;
  if (!history) return;
  const { latest } = history;
  byId("object-title").textContent = `${className(latest)} ${latest.id}${object ? "" : " (gone)"}`;
  fill("object-now", {
    speed: `${latest.speed.toFixed(1)} ± ${latest.speedDeviation.toFixed(1)} m/s`,
    heading: `${Math.round((450 - latest.yaw * 180 / Math.PI) % 360)}°`,
    size: `${latest.length.toFixed(1)} x ${latest.width.toFixed(1)} x ${latest.height.toFixed(1)} m`,
    returns: latest.points, "followed for": `${latest.age.toFixed(1)} s`,
  });
  const [speed, existence, probability] = ["speed", "existence", "classProbability"].map((name) =>
    history.states.map((state) => state[name]));
  const colour = colours[className(latest)];
  plot(byId("object-speed"), [{ colour, values: speed }], { low: 0, unit: "m/s", colours });
  plot(byId("object-confidence"), [{ colour: colours.faint, values: probability }, { colour, values: existence }],
    { low: 0, high: 1, unit: "", colours });
}
