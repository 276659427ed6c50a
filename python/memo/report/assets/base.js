"use strict";
// Shared by all pages: the data, texts and numbers, the player of frames, charts.

const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
const isNumber = (value) => typeof value === "number" && Number.isFinite(value);

/** A number with a minus sign, or a dash if unknown. */
function told(value, digits) {
  return isNumber(value) ? value.toFixed(digits).replace("-", "\u2212") : "\u2013";
}

/** An element with attributes and children; text children stay text. */
function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

function shape(name, attributes, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

// Colours of canvases: those of the style sheet's theme; on paper, the light ones.

const darkTheme = matchMedia("(prefers-color-scheme: dark)");
let onPaper = false;
const LIGHT = { ink: "#1b1f24", soft: "#5b6570", grid: "#b9c2ca", right: "#d55e00", left: "#0072b2", body: "#aeb6be", rim: "#4b545d", shadow: "rgba(0,0,0,.13)", accent: "#007a58" };
const DARK = { ink: "#e6e9ec", soft: "#a0aab4", grid: "#4a535c", right: "#ff8a3d", left: "#56b4e9", body: "#77818b", rim: "#0b0d0f", shadow: "rgba(0,0,0,.4)", accent: "#44c79a" };
const palette = () => (darkTheme.matches && !onPaper ? DARK : LIGHT);

const redrawn = [];
const redraw = () => redrawn.forEach((draw) => draw());
darkTheme.addEventListener("change", redraw);
addEventListener("beforeprint", () => { onPaper = true; redraw(); });
addEventListener("afterprint", () => { onPaper = false; redraw(); });

/** Calls `draw(context, width, height)` in CSS pixels whenever the canvas' size, the theme or the data changes. */
function drawnCanvas(canvas, aspect, draw) {
  const context = canvas.getContext("2d");
  const now = () => {
    const width = canvas.clientWidth;
    if (!width) return;
    const height = Math.round(width / aspect());
    const dense = Math.min(devicePixelRatio || 1, 2);
    if (canvas.width !== Math.round(width * dense) || canvas.height !== Math.round(height * dense)) {
      canvas.width = Math.round(width * dense);
      canvas.height = Math.round(height * dense);
      canvas.style.height = `${height}px`;
    }
    context.setTransform(dense, 0, 0, dense, 0, 0);
    context.clearRect(0, 0, width, height);
    draw(context, width, height);
  };
  new ResizeObserver(now).observe(canvas);
  redrawn.push(now);
  return now;
}

// Pictures from data URIs, loaded on demand; the last few are kept.

class Pictures {
  constructor(uris) {
    this.uris = uris;
    this.loaded = new Map();
  }

  /** The picture, or null while it is being decoded; `ready` is then called when it is done. */
  at(index, ready) {
    for (let ahead = index; ahead < Math.min(index + 6, this.uris.length); ahead += 1) this.load(ahead);
    const image = this.loaded.get(index);
    if (!image) return null;
    if (image.complete) return image.naturalWidth ? image : null;
    image.onload = ready;
    return null;
  }

  load(index) {
    if (this.loaded.has(index) || !this.uris[index]) return;
    const image = new Image();
    image.src = this.uris[index];
    this.loaded.set(index, image);
    if (this.loaded.size > 48) this.loaded.delete(this.loaded.keys().next().value);
  }
}

// The player: selects the frame shown by slider, keys, charts or time.

class Player {
  constructor(times, label) {
    this.times = times;
    this.label = label;
    this.at = 0;
    this.listeners = [];
    this.slider = $("slider");
    this.slider.max = Math.max(0, times.length - 1);
    this.slider.addEventListener("input", () => { this.pause(); this.show(Number(this.slider.value)); });
    $("play").addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    addEventListener("keydown", (event) => this.key(event));
    if (times.length < 2) $("player").hidden = true;
  }

  key(event) {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const inside = event.target instanceof Element && event.target.closest("input, select, textarea, button, canvas[tabindex]");
    if (inside) return;
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (step) { this.pause(); this.show(this.at + step); }
    else if (event.key === " ") { if (this.playing) this.pause(); else this.play(); }
    else return;
    event.preventDefault();
  }

  show(index) {
    this.at = Math.max(0, Math.min(this.times.length - 1, index));
    this.slider.value = this.at;
    const words = this.label(this.at);
    this.slider.setAttribute("aria-valuetext", words);
    $("clock").textContent = words;
    this.listeners.forEach((listener) => listener(this.at));
  }

  /** Goes to the frame nearest in time. */
  seek(time) {
    let nearest = 0;
    this.times.forEach((other, index) => {
      if (Math.abs(other - time) < Math.abs(this.times[nearest] - time)) nearest = index;
    });
    this.pause();
    this.show(nearest);
  }

  play() {
    if (this.times.length < 2) return;
    if (this.at >= this.times.length - 1) this.show(0);
    this.playing = true;
    $("play").textContent = "\u275A\u275A";
    $("play").setAttribute("aria-label", "Pause");
    let before = null;
    let position = this.times[this.at];
    const tick = (now) => {
      if (!this.playing) return;
      if (before !== null) position += ((now - before) / 1000) * Number($("speed").value);
      before = now;
      let next = this.at;
      while (next < this.times.length - 1 && this.times[next + 1] <= position) next += 1;
      if (next !== this.at) this.show(next);
      if (next >= this.times.length - 1) this.pause();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    $("play").textContent = "\u25B6";
    $("play").setAttribute("aria-label", "Play");
  }
}

// Charts: curves over one axis, with spreads, a band, marks and the current position.

const MARGIN = { left: 44, right: 10, top: 8, bottom: 32 };

function niceStep(span, count) {
  const rough = span / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= rough * 0.999);
}

function ticks(low, high, count) {
  const step = niceStep(high - low, count);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) found.push(k * step);
  return [found, Math.max(0, -Math.floor(Math.log10(step) + 1e-9))];
}

/** `M x y L x y` through points; null starts a new line. */
function path(points) {
  let pen = "M";
  let written = "";
  for (const point of points) {
    if (point === null) { pen = "M"; continue; }
    written += `${pen}${point[0].toFixed(1)} ${point[1].toFixed(1)}`;
    pen = "L";
  }
  return written;
}

/** The runs of indices without a gap or an unknown value. */
function stretches(xs, ys, gaps) {
  const found = [];
  let open = null;
  ys.forEach((y, index) => {
    const known = isNumber(y) && isNumber(xs[index]);
    if (!known) { open = null; return; }
    if (open === null || gaps?.[index]) { open = []; found.push(open); }
    open.push(index);
  });
  return found;
}

/**
 * A chart in `host`. `spec`: title, unit, digits, xs, xLabel, xRange, yRange, curves [{name, ys, sds, gaps, look}],
 * band {xs, ys, sds}, marks [{x, look}], seek(x), hover(x) that returns {x, ys, words}. Returns a function
 * (x, values, words) that shows the current position.
 */
function chart(host, spec) {
  const value = element("span");
  const title = element("h3", {}, spec.title, value);
  const svg = shape("svg", { role: "img" });
  host.classList.add("chart");
  host.append(title, svg);
  let now = null;
  let scales = null;

  const range = () => {
    if (spec.yRange) return spec.yRange;
    let low = Infinity;
    let high = -Infinity;
    for (const { ys, sds } of [...spec.curves, ...(spec.band ? [spec.band] : [])]) {
      ys.forEach((y, index) => {
        if (!isNumber(y)) return;
        const sd = isNumber(sds?.[index]) ? sds[index] : 0;
        low = Math.min(low, y - sd);
        high = Math.max(high, y + sd);
      });
    }
    if (low > high) return [0, 1];
    const margin = Math.max((high - low) * 0.06, spec.least ?? 1e-3);
    return [low - margin, high + margin];
  };

  const draw = () => {
    const width = host.clientWidth;
    if (!width) return;
    const height = spec.height ?? 150;
    const [xLow, xHigh] = spec.xRange;
    const [yLow, yHigh] = range();
    const x = (v) => MARGIN.left + ((v - xLow) / (xHigh - xLow || 1)) * (width - MARGIN.left - MARGIN.right);
    const y = (v) => height - MARGIN.bottom - ((Math.min(Math.max(v, yLow), yHigh) - yLow) / (yHigh - yLow)) * (height - MARGIN.top - MARGIN.bottom);
    scales = { x, y, width, height };
    svg.replaceChildren();
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.setAttribute("aria-label", `${spec.title}, from ${told(yLow, spec.digits)} to ${told(yHigh, spec.digits)} ${spec.unit}`);
    const [yTicks, yDigits] = ticks(yLow, yHigh, 5);
    for (const tick of yTicks) {
      svg.append(shape("line", { class: "grid", x1: MARGIN.left, x2: width - MARGIN.right, y1: y(tick), y2: y(tick) }));
      svg.append(shape("text", { x: MARGIN.left - 6, y: y(tick) + 3.5, "text-anchor": "end" }, told(tick, yDigits)));
    }
    const [xTicks, xDigits] = ticks(xLow, xHigh, width < 400 ? 4 : 6);
    for (const tick of xTicks) {
      svg.append(shape("line", { class: "axis", x1: x(tick), x2: x(tick), y1: height - MARGIN.bottom, y2: height - MARGIN.bottom + 4 }));
      svg.append(shape("text", { x: x(tick), y: height - MARGIN.bottom + 15, "text-anchor": "middle" }, told(tick, xDigits)));
    }
    svg.append(shape("line", { class: "axis", x1: MARGIN.left, x2: width - MARGIN.right, y1: height - MARGIN.bottom, y2: height - MARGIN.bottom }));
    svg.append(shape("text", { x: width - MARGIN.right, y: height - MARGIN.bottom + 28, "text-anchor": "end" }, spec.xLabel));
    const spread = ({ xs, ys, sds, gaps }, look) => {
      for (const indices of stretches(xs, ys, gaps)) {
        const known = indices.filter((index) => isNumber(sds[index]));
        if (known.length < 2) continue;
        const upper = known.map((index) => [x(xs[index]), y(ys[index] + sds[index])]);
        const lower = known.map((index) => [x(xs[index]), y(ys[index] - sds[index])]).reverse();
        svg.append(shape("path", { class: look, d: `${path([...upper, ...lower])}Z` }));
      }
    };
    const line = ({ xs, ys, gaps }, look) => {
      const points = stretches(xs, ys, gaps).flatMap((indices) => [null, ...indices.map((index) => [x(xs[index]), y(ys[index])])]);
      svg.append(shape("path", { class: look, d: path(points) }));
    };
    if (spec.band) {
      spread(spec.band, "band");
      line(spec.band, "average");
    }
    for (const mark of spec.marks ?? []) {
      if (mark.x < xLow || mark.x > xHigh) continue;
      svg.append(shape("line", { class: `mark ${mark.look}`, x1: x(mark.x), x2: x(mark.x), y1: MARGIN.top, y2: height - MARGIN.bottom }, shape("title", {}, mark.name)));
    }
    for (const curve of spec.curves) {
      const full = { xs: spec.xs, ...curve };
      if (curve.sds) spread(full, `spread ${curve.look ?? ""}`);
      line(full, `curve ${curve.look ?? ""}`);
    }
    mark();
  };

  const mark = () => {
    svg.querySelectorAll(".now, .dot").forEach((old) => old.remove());
    if (!now || !scales || !isNumber(now.x)) return;
    const { x, y, height } = scales;
    if (!spec.noLine) svg.append(shape("line", { class: "now", x1: x(now.x), x2: x(now.x), y1: MARGIN.top, y2: height - MARGIN.bottom }));
    for (const known of now.ys.filter(isNumber)) svg.append(shape("circle", { class: "dot", cx: x(now.x), cy: y(known), r: 4 }));
  };

  if (spec.seek) {
    const go = (event) => {
      const [xLow, xHigh] = spec.xRange;
      const box = svg.getBoundingClientRect();
      const share = (event.clientX - box.left - MARGIN.left) / (box.width - MARGIN.left - MARGIN.right);
      spec.seek(xLow + share * (xHigh - xLow));
    };
    svg.addEventListener("pointerdown", (event) => { svg.setPointerCapture(event.pointerId); go(event); });
    svg.addEventListener("pointermove", (event) => { if (event.buttons) go(event); });
  }
  const show = (x, ys, words) => {
    now = { x, ys };
    value.textContent = words;
    mark();
  };
  if (spec.hover) {
    svg.addEventListener("pointermove", (event) => {
      const [xLow, xHigh] = spec.xRange;
      const box = svg.getBoundingClientRect();
      const share = (event.clientX - box.left - MARGIN.left) / (box.width - MARGIN.left - MARGIN.right);
      const { x, ys, words } = spec.hover(xLow + Math.min(1, Math.max(0, share)) * (xHigh - xLow));
      show(x, ys, words);
    });
    svg.addEventListener("pointerleave", () => show(NaN, [], spec.words ?? ""));
    value.textContent = spec.words ?? "";
  }
  new ResizeObserver(draw).observe(host);
  return { draw, show };
}
