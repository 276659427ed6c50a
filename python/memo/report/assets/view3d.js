// A small 3D view on a canvas: an eye that orbits a point, items sorted by depth.

const sum = (a, b) => a.map((value, k) => value + b[k]);
const difference = (a, b) => a.map((value, k) => value - b[k]);
const scaled = (a, factor) => a.map((value) => value * factor);
const dot = (a, b) => a.reduce((total, value, k) => total + value * b[k], 0);
const mean = (points) => scaled(points.reduce(sum), 1 / points.length);
const known = (...points) => points.every((point) => point && point.every(isNumber));
const NEAR_M = 0.05;

class View3D {
  /** `scene(view)` adds items to the view by `line`, `limb`, `ball`, `face` and `label`; `aspect()` is width over height. */
  constructor(canvas, scene, aspect = () => 4 / 3) {
    this.canvas = canvas;
    this.scene = scene;
    this.home = { yaw: -1.15, pitch: 0.22, distance: 3.4 };
    Object.assign(this, this.home);
    this.target = [0, 0, 0.9];
    this.draw = drawnCanvas(canvas, () => (canvas.clientWidth < 500 ? 1.1 : aspect()), (...args) => this.paint(...args));
    this.listen();
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.min(1.55, Math.max(-0.15, this.pitch + pitch));
    this.draw();
  }

  zoom(factor) {
    this.distance = Math.min(40, Math.max(1, this.distance * factor));
    this.draw();
  }

  listen() {
    const pointers = new Map();
    const spread = () => {
      const [a, b] = [...pointers.values()];
      return Math.hypot(a[0] - b[0], a[1] - b[1]);
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const apart = pointers.size === 2 ? spread() : 0;
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      if (pointers.size === 2) this.zoom(apart / Math.max(1, spread()));
      else this.turn(-(event.clientX - before[0]) * 0.01, (event.clientY - before[1]) * 0.008);
    });
    for (const end of ["pointerup", "pointercancel"]) this.canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
    this.canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== this.canvas && !event.ctrlKey) return; // else the page scrolls
      event.preventDefault();
      this.zoom(Math.exp(event.deltaY * 0.001));
    }, { passive: false });
    this.canvas.addEventListener("keydown", (event) => {
      const turns = { ArrowLeft: [0.12, 0], ArrowRight: [-0.12, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
      if (turns[event.key]) this.turn(...turns[event.key]);
      else if (event.key === "+" || event.key === "=") this.zoom(0.9);
      else if (event.key === "-") this.zoom(1.1);
      else return;
      event.preventDefault();
    });
  }

  paint(context, width, height) {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    this.eye = sum(this.target, scaled([cp * cy, cp * sy, sp], this.distance));
    this.right = [-sy, cy, 0];
    this.forward = [-cp * cy, -cp * sy, -sp];
    this.up = [-sp * cy, -sp * sy, cp];
    this.focal = 1.35 * Math.min(width, height);
    this.middle = [width / 2, height / 2];
    this.things = [];
    this.context = context;
    this.ground();
    this.flush();
    this.scene(this);
    this.flush();
  }

  /** Depth along the line of sight, metres. */
  depth(point) {
    return dot(difference(point, this.eye), this.forward);
  }

  place(point) {
    const from = difference(point, this.eye);
    const factor = this.focal / Math.max(NEAR_M, dot(from, this.forward));
    return [this.middle[0] + factor * dot(from, this.right), this.middle[1] - factor * dot(from, this.up)];
  }

  /** Nearer items are painted later. */
  flush() {
    this.things.sort((a, b) => b.depth - a.depth);
    for (const thing of this.things) thing.paint(this.context);
    this.things = [];
  }

  add(points, paint, towards = 0) {
    const depths = points.map((point) => this.depth(point));
    if (Math.min(...depths) < NEAR_M) return;
    this.things.push({ depth: depths.reduce((a, b) => a + b) / depths.length - towards, paint });
  }

  line(a, b, colour, widthPx = 1, opacity = 1) {
    if (!known(a, b)) return;
    this.add([a, b], (context) => {
      context.globalAlpha = opacity;
      context.strokeStyle = colour;
      context.lineWidth = widthPx;
      context.lineCap = "round";
      context.beginPath();
      context.moveTo(...this.place(a));
      context.lineTo(...this.place(b));
      context.stroke();
      context.globalAlpha = 1;
    });
  }

  /** A rod with round ends, as thick as it is in metres; `rim` is its outline. */
  limb(a, b, radius, colour, rim, opacity = 1) {
    if (!known(a, b)) return;
    this.add([a, b], (context) => {
      const widthPx = Math.max(2, (2 * radius * this.focal) / Math.max(NEAR_M, this.depth(mean([a, b]))));
      context.lineCap = "round";
      context.globalAlpha = opacity;
      for (const [extra, paint] of [[2, rim], [0, colour]]) {
        context.strokeStyle = paint;
        context.lineWidth = widthPx + extra;
        context.beginPath();
        context.moveTo(...this.place(a));
        context.lineTo(...this.place(b));
        context.stroke();
      }
      context.globalAlpha = 1;
    });
  }

  ball(centre, radius, colour, rim, opacity = 1) {
    if (!known(centre)) return;
    this.add([centre], (context) => {
      context.globalAlpha = opacity;
      context.fillStyle = colour;
      context.strokeStyle = rim;
      context.lineWidth = 1;
      context.beginPath();
      context.arc(...this.place(centre), (radius * this.focal) / this.depth(centre), 0, 2 * Math.PI);
      context.fill();
      context.stroke();
      context.globalAlpha = 1;
    });
  }

  face(points, colour, rim, opacity = 1) {
    if (!known(...points)) return;
    this.add(points, (context) => {
      context.globalAlpha = opacity;
      context.fillStyle = colour;
      context.strokeStyle = rim;
      context.lineWidth = 1;
      context.lineJoin = "round";
      context.beginPath();
      points.forEach((point, k) => (k ? context.lineTo(...this.place(point)) : context.moveTo(...this.place(point))));
      context.closePath();
      context.fill();
      if (rim) context.stroke();
      context.globalAlpha = 1;
    });
  }

  label(point, words, colour) {
    this.add([point], (context) => {
      context.fillStyle = colour;
      context.font = "600 12px system-ui, sans-serif";
      context.fillText(words, ...this.place(point));
    }, 0.05);
  }

  /** The ground around the target, in squares of half a metre, fading; and the axes at the origin. */
  ground() {
    const { grid, soft } = palette();
    const reach = Math.min(12, Math.max(3, Math.ceil(this.distance)));
    const [x0, y0] = this.target.slice(0, 2).map((value) => Math.round(value * 2) / 2);
    for (let along = -reach; along <= reach; along += 0.5) {
      for (let at = -reach; at < reach; at += 1) {
        const fade = 1 - Math.hypot(along, at + 0.5) / reach;
        if (fade <= 0) continue;
        this.line([x0 + along, y0 + at, 0], [x0 + along, y0 + at + 1, 0], grid, 1, fade);
        this.line([x0 + at, y0 + along, 0], [x0 + at + 1, y0 + along, 0], grid, 1, fade);
      }
    }
    [["X", [0.5, 0, 0]], ["Y", [0, 0.5, 0]], ["Z", [0, 0, 0.5]]].forEach(([name, end]) => {
      this.line([0, 0, 0], end, soft, 1.5);
      this.label(scaled(end, 1.12), name, soft);
    });
  }

  /** From a side: the azimuth of the eye and its height, radians. */
  from(yaw, pitch) {
    Object.assign(this, { yaw, pitch });
    this.draw();
  }
}

// The figure of both pages: limbs by name, metres.

const LIMBS = [
  ["shoulder", "elbow", 0.045], ["elbow", "wrist", 0.036], ["hip", "knee", 0.066], ["knee", "ankle", 0.046],
];

/** A figure of rods; `joint(name)` gives a point or null, `bones` is the style: thick or thin, or transparent. */
function figure(view, joint, { opacity = 1, thickness = 1, plain: plainColour = null } = {}) {
  const { right, left, body, rim, shadow } = palette();
  const trunk = ["right_shoulder", "left_shoulder", "left_hip", "right_hip"].map(joint);
  const trunkColour = plainColour ?? body;
  view.face(trunk, trunkColour, rim, 0.85 * opacity);
  for (const k of [0, 2]) view.limb(trunk[k], trunk[k + 1], 0.04 * thickness, trunkColour, rim, opacity);
  for (const [k, l] of [[0, 3], [1, 2]]) view.limb(trunk[k], trunk[l], 0.03 * thickness, trunkColour, rim, opacity);
  if (known(...trunk)) {
    const [neck, pelvis] = [mean(trunk.slice(0, 2)), mean(trunk.slice(2))];
    const up = difference(neck, pelvis);
    const above = (height) => sum(neck, scaled(up, height / Math.max(0.1, Math.hypot(...up))));
    view.limb(above(-0.06), pelvis, 0.085 * thickness, trunkColour, rim, opacity);
    view.limb(above(-0.06), above(0.12), 0.05 * thickness, trunkColour, rim, opacity);
    view.ball(above(0.2), 0.105 * Math.sqrt(thickness), trunkColour, rim, opacity);
  }
  for (const [side, colour] of [["left", left], ["right", right]]) {
    for (const [from, to, radius] of LIMBS) {
      const ends = [joint(`${side}_${from}`), joint(`${side}_${to}`)];
      if (opacity === 1 && known(...ends)) view.line(...ends.map(([x, y]) => [x, y, 0]), shadow, 9);
      view.limb(...ends, radius * thickness, plainColour ?? colour, rim, opacity);
    }
  }
}

/** Camera centre and viewing direction in the world from a Rodrigues rotation and a translation. */
function cameraPose({ rotation, translation }) {
  const angle = Math.hypot(...rotation);
  const axis = angle ? scaled(rotation, 1 / angle) : [0, 0, 1];
  const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];
  const worldFromCamera = (v) => // the inverse is a rotation back by the same angle
    sum(sum(scaled(v, Math.cos(angle)), scaled(cross(axis, v), -Math.sin(angle))), scaled(axis, dot(axis, v) * (1 - Math.cos(angle))));
  return { centre: scaled(worldFromCamera(translation), -1), forward: worldFromCamera([0, 0, 1]) };
}
