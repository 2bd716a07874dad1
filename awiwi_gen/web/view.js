/* The hand in 3-D on a canvas: points of the forearm's frame [m], seen from far away. */
"use strict";

class View {
  constructor(canvas, reach) {
    this.canvas = canvas;
    this.start = { turn: -0.9, tilt: 0.42, zoom: 1 };
    this.reach = reach;
    this.centre = [0, 0, 0];
    [this.half, this.aside] = [[1, 1], [0, 0]];
    this.redraw = () => {};
    this.reset();
    this.listen();
  }

  reset() {
    Object.assign(this, this.start);
  }

  /* Choose the middle and the scale of the picture such that these points fit into it, as it is turned first. */
  lookAt(points) {
    const middle = (values) => (Math.min(...values) + Math.max(...values)) / 2;
    [this.width, this.height, this.scale] = [0, 0, 1];
    this.centre = [0, 1, 2].map((i) => middle(points.map((p) => p[i])));
    const seen = points.map((p) => this.seen(p));
    this.aside = [middle(seen.map((p) => p.x)), middle(seen.map((p) => p.y))];
    this.half = [Math.max(...seen.map((p) => p.x)) - this.aside[0], Math.max(...seen.map((p) => p.y)) - this.aside[1]];
  }

  listen() {
    const { canvas } = this;
    const change = (turn, tilt, zoom = 1) => {
      this.turn += turn;
      this.tilt = Math.min(Math.max(this.tilt + tilt, -1.5), 1.5);
      this.zoom = Math.min(Math.max(this.zoom * zoom, 0.4), 6);
      this.redraw();
    };
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons & 1) change(-0.01 * event.movementX, 0.01 * event.movementY);
    });
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    const keys = {
      ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1],
      "+": [0, 0, 1.15], "=": [0, 0, 1.15], "-": [0, 0, 1 / 1.15],
    };
    canvas.addEventListener("keydown", (event) => {
      if (event.key === "Home") this.reset();
      if (event.key !== "Home" && !(event.key in keys)) return;
      event.preventDefault();
      change(...(keys[event.key] ?? [0, 0]));
    });
  }

  /* A point on the canvas [px], and how near it is [m]. */
  seen(p) {
    const [x, y, z] = p.map((each, i) => each - this.centre[i]);
    const [ct, st, ce, se] = [Math.cos(this.turn), Math.sin(this.turn), Math.cos(this.tilt), Math.sin(this.tilt)];
    const [right, away] = [ct * y - st * x, -(ct * x + st * y)];
    const [dx, dy] = this.aside;
    const up = ce * z + se * away;
    return { x: this.width / 2 + this.scale * (right - dx), y: this.height / 2 - this.scale * (up + dy), near: se * z - ce * away };
  }

  begin() {
    const { canvas } = this;
    const dense = globalThis.devicePixelRatio || 1;
    [this.width, this.height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(this.width * dense)) canvas.width = Math.round(this.width * dense);
    if (canvas.height !== Math.round(this.height * dense)) canvas.height = Math.round(this.height * dense);
    this.scale = 0.42 * this.zoom * Math.min(this.width / this.half[0], this.height / this.half[1]);
    const style = getComputedStyle(canvas);
    this.colour = (name) => style.getPropertyValue(`--${name}`).trim();
    this.context = canvas.getContext("2d");
    this.context.setTransform(dense, 0, 0, dense, 0, 0);
    this.context.clearRect(0, 0, this.width, this.height);
    this.context.lineCap = this.context.lineJoin = "round";
    this.shapes = [];
  }

  line(points, colour, width, options = {}) {
    const seen = points.map((p) => this.seen(p));
    const near = seen.reduce((sum, p) => sum + p.near, 0) / seen.length + (options.lift ?? 0);
    this.shapes.push({ near, seen, colour, width, ...options });
  }

  /* A bone between two points: round, lighter in the middle. */
  bone(from, to, radius, colour, edge) {
    const width = 2 * radius * this.scale;
    this.line([from, to], edge, width + 2);
    this.line([from, to], colour, width, { lift: 1e-5 });
    this.line([from, to], this.colour("shine"), 0.35 * width, { lift: 2e-5 });
  }

  circle(pose, radius, colour, width, options = {}) {
    const turns = Array.from({ length: 33 }, (_, i) => (2 * Math.PI * i) / 32);
    this.line(turns.map((t) => posed(pose, [radius * Math.cos(t), radius * Math.sin(t), 0])), colour, width, options);
  }

  /* An ellipsoid by its centre and half axes: the ellipses in its principal planes. */
  ellipsoid(centre, axes, colour) {
    const turns = Array.from({ length: 49 }, (_, i) => (2 * Math.PI * i) / 48);
    for (const [a, b] of [[axes[0], axes[1]], [axes[1], axes[2]], [axes[2], axes[0]]]) {
      const points = turns.map((t) => centre.map((c, i) => c + Math.cos(t) * a[i] + Math.sin(t) * b[i]));
      this.line(points, colour, 1.6, { lift: this.reach, fill: 0.16 });
    }
  }

  area(points, colour) {
    this.line(points, colour, 1, { fill: 0.35, lift: -1 });
  }

  text(place, words, colour) {
    this.shapes.push({ near: Infinity, seen: [this.seen(place)], colour, words });
  }

  end() {
    const { context } = this;
    for (const shape of this.shapes.sort((a, b) => a.near - b.near)) {
      context.strokeStyle = context.fillStyle = shape.colour;
      if (shape.words) {
        context.font = "13px sans-serif";
        context.textAlign = "center";
        context.fillText(shape.words, shape.seen[0].x, shape.seen[0].y);
        continue;
      }
      context.lineWidth = shape.width;
      context.setLineDash(shape.dash ?? []);
      context.beginPath();
      shape.seen.forEach((p, i) => (i ? context.lineTo(p.x, p.y) : context.moveTo(p.x, p.y)));
      if (shape.fill) {
        context.globalAlpha = shape.fill;
        context.fill();
        context.globalAlpha = 1;
      }
      context.stroke();
    }
  }
}
