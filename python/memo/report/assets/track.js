// The page of a tracked walk.

const { pictures, track: everybody } = data;
const timeOf = new Map(everybody.frame.map((frame, row) => [frame, everybody.time_s[row]]));
const frames = pictures.frame.length ? pictures.frame : [...timeOf.keys()].sort((a, b) => a - b);
const times = pictures.frame.length ? pictures.time_s : frames.map((frame) => timeOf.get(frame));
const jointAt = new Map((everybody.joints ?? []).map((name, index) => [name, index]));

// The person shown: rows of the tables, events, and explained frames.

const people = [...new Set(everybody.person)].sort((a, b) => a - b);
let person = people[0];
let track = everybody;
let [events, why] = [data.events, data.why];
let [rowOf, whyOf, walks] = [new Map(), new Map(), new Set()];

function choose(chosen) {
  person = chosen;
  const rows = everybody.frame.flatMap((_, row) => (everybody.person[row] === person ? [row] : []));
  const columns = Object.entries(everybody).filter(([name]) => name !== "joints");
  track = { joints: everybody.joints, ...Object.fromEntries(columns.map(([name, values]) => [name, rows.map((row) => values[row])])) };
  walks = new Set(track.walk);
  events = data.events.filter((event) => people.length < 2 || walks.has(event.walk));
  why = data.why.filter((item) => people.length < 2 || walks.has(item.walk));
  rowOf = new Map(track.frame.map((frame, row) => [frame, row]));
  whyOf = new Map(why.map((item, index) => [item.frame, index]));
}
choose(person);

const player = new Player(times, (index) => {
  const row = rowOf.get(frames[index]);
  const where = `frame ${frames[index]}, ${told(times[index], 2)} s`;
  return row === undefined ? `${where}, ${people.length > 1 ? "not this person" : "nobody tracked"}` : `${where}, phase ${told(track.phase[row], 2)}`;
});
const rowNow = () => rowOf.get(frames[player.at]);

// The frame with the model on it.

const CHAINS = ["right", "left"].flatMap((side) => [["shoulder", "elbow", "wrist"], ["hip", "knee", "ankle"]].map((chain) => [side, chain.map((joint) => `${side}_${joint}`)]));
const TRAIL_S = 1;
const stagePictures = new Pictures(pictures.uri);
const movedPictures = new Pictures(pictures.moved);

/** Segments from base64: [[u, v], [u, v]] each, in pixels of the part shown. */
const unpackedOf = new Map();
function unpacked(text, stepPx) {
  if (!unpackedOf.has(text)) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const values = new DataView(bytes.buffer);
    const segments = [];
    for (let at = 0; at + 8 <= bytes.length; at += 8) {
      const [a, b, c, d] = [0, 2, 4, 6].map((next) => values.getInt16(at + next, true) * stepPx);
      segments.push([[a, b], [c, d]]);
    }
    if (unpackedOf.size > 64) unpackedOf.clear();
    unpackedOf.set(text, segments);
  }
  return unpackedOf.get(text);
}

function strokes(context, segments, colour, width, place) {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.lineCap = "round";
  context.beginPath();
  for (const [from, to] of segments) {
    context.moveTo(...place(from));
    context.lineTo(...place(to));
  }
  context.stroke();
}

/** The joints of the other people in the frame shown, pixels. */
function othersNow() {
  if (people.length < 2) return [];
  const frame = frames[player.at];
  return everybody.points_px.filter((_, row) => everybody.frame[row] === frame && everybody.person[row] !== person);
}

function stageSize() {
  if (pictures.size) return pictures.size;
  const image = stagePictures.at(player.at, drawStage);
  return image ? [image.naturalWidth, image.naturalHeight] : [4, 3];
}

const drawStage = drawnCanvas($("stage"), () => stageSize()[0] / stageSize()[1], (context, width, height) => {
  const image = stagePictures.at(player.at, () => drawStage());
  if (pictures.uri.length && !image) return;
  context.fillStyle = "#2a2f34";
  context.fillRect(0, 0, width, height);
  if (image) context.drawImage(image, 0, 0, width, height);
  const row = rowNow();
  const [factorU, factorV] = [width / stageSize()[0], height / stageSize()[1]];
  const moved = movedPictures.at(player.at, () => drawStage());
  if (moved) {
    context.globalAlpha = 0.55;
    context.drawImage(moved, 0, 0, width, height);
    context.globalAlpha = 1;
    context.strokeStyle = "#f0e442";
    context.lineWidth = 1.5;
    for (const [left, top, right, bottom] of pictures.regions[player.at]) {
      context.strokeRect(left * factorU, top * factorV, (right + 1 - left) * factorU, (bottom + 1 - top) * factorV);
    }
  }
  if (pictures.drawn) return;
  const place = ([u, v]) => [(u + 0.5) * factorU, (v + 0.5) * factorV];
  const thick = Math.max(1.5, width / 300);
  if ($("show-limbs").checked) {
    for (const points of othersNow()) {
      const limbs = CHAINS.flatMap(([, chain]) => [0, 1].map((k) => [k, k + 1].map((n) => points[jointAt.get(chain[n])])));
      strokes(context, limbs.filter((ends) => known(...ends)), "rgba(255,255,255,.6)", thick * 0.7, place);
    }
  }
  if (row === undefined) return;
  const at = (other, name) => track.points_px[other][jointAt.get(name)];
  const explained = whyOf.get(frames[player.at]);
  if ($("show-contours").checked && explained !== undefined) {
    const { model, corner, step_px } = why[explained];
    strokes(context, unpacked(model, step_px), "#f0e442", thick * 0.7, ([u, v]) => place([u + corner[0], v + corner[1]]));
  }
  for (const [side, chain] of CHAINS) {
    const colour = DARK[side]; // a picture has the same brightness in every theme
    if ($("show-trail").checked && chain[2].endsWith("ankle")) {
      context.globalAlpha = 0.55;
      const trail = [];
      for (let other = row; other > 0 && track.walk[other - 1] === track.walk[row] && track.time_s[row] - track.time_s[other - 1] <= TRAIL_S; other -= 1) {
        trail.push([at(other - 1, chain[2]), at(other, chain[2])]);
      }
      strokes(context, trail.filter((ends) => known(...ends)), colour, thick * 0.7, place);
      context.globalAlpha = 1;
    }
    if ($("show-limbs").checked) {
      const points = chain.map((name) => at(row, name));
      const limbs = [[points[0], points[1]], [points[1], points[2]]].filter((ends) => known(...ends));
      strokes(context, limbs, "rgba(0,0,0,.55)", thick + 2, place);
      strokes(context, limbs, colour, thick, place);
    }
  }
});
$("layers").hidden = pictures.drawn || !everybody.frame.length;
for (const id of ["show-limbs", "show-contours", "show-trail"]) $(id).addEventListener("change", drawStage);

// The walker in 3D.

const point = (row, name) => track.points_m[row][jointAt.get(name)];
const torso = (row) => [track.x_m[row], track.y_m[row], track.z_m[row]];
const camera = data.camera && cameraPose(data.camera);

const view = new View3D($("view"), (self) => {
  const { soft, right, left, accent } = palette();
  const row = rowNow();
  const walk = row === undefined ? track.walk[0] : track.walk[row];
  for (let other = 1; other < track.frame.length; other += 1) {
    if (track.walk[other] !== walk || track.walk[other - 1] !== walk) continue;
    const ends = [other - 1, other].map((k) => [track.x_m[k], track.y_m[k], 0]);
    self.line(...ends, soft, 1.5, 0.8);
    if (row === undefined || other > row || track.time_s[row] - track.time_s[other] > TRAIL_S) continue;
    self.line(point(other - 1, "right_ankle"), point(other, "right_ankle"), right, 2, 0.6);
    self.line(point(other - 1, "left_ankle"), point(other, "left_ankle"), left, 2, 0.6);
  }
  if (camera) {
    self.ball(camera.centre, 0.06, accent, accent);
    self.line(camera.centre, sum(camera.centre, scaled(camera.forward, 0.5)), accent, 3);
    self.label(sum(camera.centre, [0, 0, 0.15]), "camera", accent);
  }
  if (row !== undefined) figure(self, (name) => (known(point(row, name)) ? point(row, name) : null));
}, () => Math.min(16 / 9, Math.max(1, stageSize()[0] / stageSize()[1])));

function aim() {
  const row = rowNow() ?? (track.frame.length ? 0 : undefined);
  if (row === undefined) return;
  if ($("follow").checked && known(torso(row))) view.target = [track.x_m[row], track.y_m[row], 0.85];
  else {
    const here = track.x_m.flatMap((_, other) => (track.walk[other] === track.walk[row] && known(torso(other)) ? [torso(other)] : []));
    const [low, high] = [0, 1].map((k) => [Math.min(...here.map((p) => p[k])), Math.max(...here.map((p) => p[k]))]);
    if (here.length) view.target = [(low[0] + low[1]) / 2, (high[0] + high[1]) / 2, 0.85];
  }
}
$("follow").addEventListener("change", () => {
  view.distance = $("follow").checked ? view.home.distance : view.home.distance * 1.8;
  aim();
  view.draw();
});
$("views").addEventListener("click", (event) => {
  const heading = track.heading_rad?.[rowNow() ?? 0] ?? 0;
  const away = camera ? difference(camera.centre, view.target) : [0, -1, 0.1];
  const sides = {
    camera: [Math.atan2(away[1], away[0]), Math.atan2(away[2], Math.hypot(away[0], away[1]))],
    side: [heading - Math.PI / 2, 0.02],
    front: [heading, 0.1],
    top: [heading - Math.PI / 2, 1.55],
  };
  const chosen = sides[event.target.dataset?.view];
  if (chosen) view.from(...chosen);
});

// Explanation.

const PARTS = [["head", 0, 0], ["torso", 1, 1], ["right arm", 2, 4], ["left arm", 5, 7], ["right leg", 8, 10], ["left leg", 11, 13]];
let whyPictures = {};
let whyNow = 0;

/** Red without support, yellow to green with support; the same green from a half on. */
const matchColour = (share) => (share > 0 ? `hsl(${Math.round(60 + 80 * Math.min(1, 2 * share))} 90% 50%)` : "#e5484d");
const partColour = (part) => (part >= 8 ? (part <= 10 ? DARK.right : DARK.left) : part >= 5 ? DARK.left : part >= 2 ? DARK.right : "#f0e442");
const WHY = {
  "why-change": (context, item, images, place, size) => {
    context.globalAlpha = 0.6;
    context.drawImage(images.change, 0, 0, ...size);
    context.globalAlpha = 1;
  },
  "why-edges": (context, item, images, place, size) => {
    context.fillStyle = "rgba(0,0,0,.5)";
    context.fillRect(0, 0, ...size);
    context.drawImage(images.edges, 0, 0, ...size);
    strokes(context, unpacked(item.segments, item.step_px), "#56b4e9", 1.3, place);
  },
  "why-model": (context, item, images, place) => {
    unpacked(item.model, item.step_px).forEach((segment, k) => strokes(context, [segment], partColour(item.part[k]), 2, place));
  },
  "why-match": (context, item, images, place, size) => {
    context.fillStyle = "rgba(0,0,0,.5)";
    context.fillRect(0, 0, ...size);
    unpacked(item.model, item.step_px).forEach((segment, k) => strokes(context, [segment], matchColour(item.matched[k]), 3, place));
    strokes(context, unpacked(item.matched_edges, item.step_px), "#ffffff", 1.2, place);
  },
};
const whyDraws = Object.entries(WHY).map(([id, paint]) =>
  drawnCanvas($(id), () => (why.length ? Math.max(0.6, why[whyNow].size[0] / why[whyNow].size[1]) : 1), (context, width, height) => {
    if (!why.length) return;
    const item = why[whyNow];
    const images = Object.fromEntries(Object.entries(whyPictures).map(([name, held]) => [name, held.at(whyNow, drawWhy)]));
    if (Object.values(images).includes(null)) return;
    const factor = Math.min(width / item.size[0], height / item.size[1]);
    const size = [item.size[0] * factor, item.size[1] * factor];
    context.translate((width - size[0]) / 2, (height - size[1]) / 2);
    context.drawImage(images.luma, 0, 0, ...size);
    context.save();
    context.beginPath();
    context.rect(0, 0, ...size);
    context.clip();
    paint(context, item, images, ([u, v]) => [(u + 0.5) * factor, (v + 0.5) * factor], size);
    context.restore();
  }),
);
function drawWhy() {
  whyDraws.forEach((draw) => draw());
}

let similarity = null;
function showWhy() {
  if (!why.length) return;
  const frame = frames[player.at];
  const [first, last] = [why[0].frame, why[why.length - 1].frame];
  let nearest = 0;
  why.forEach((item, index) => {
    if (Math.abs(item.frame - frame) < Math.abs(why[nearest].frame - frame)) nearest = index;
  });
  whyNow = nearest;
  const item = why[nearest];
  $("why-frame").textContent = item.frame === frame ? `frame ${frame}` : `frame ${item.frame}, the nearest one explained (from ${first} to ${last})`;
  drawWhy();
  const host = $("similarity-chart");
  host.replaceChildren();
  const peak = item.similarity.reduce((best, value, k) => (isNumber(value) && Math.abs(item.phase_grid[k] - item.phase) < Math.abs(item.phase_grid[best] - item.phase) ? k : best), 0);
  similarity = chart(host, {
    title: "Similarity over the gait phase, at this frame's position",
    unit: "", digits: 2, xs: item.phase_grid, xRange: [0, 1], xLabel: "gait phase", height: 170,
    curves: [{ ys: item.similarity }],
    marks: isNumber(item.phase) ? [{ x: (item.phase + 0.5) % 1, look: "axis", name: "half a cycle away: left and right interchanged" }] : [],
  });
  similarity.draw();
  similarity.show(item.phase, [item.similarity[peak]], `best at ${told(item.phase, 2)}; dotted: half a cycle away`);
  const rows = PARTS.map(([name, from, to]) => {
    let [visible, found] = [0, 0];
    unpacked(item.model, item.step_px).forEach(([[a, b], [c, d]], k) => {
      if (item.part[k] < from || item.part[k] > to || !isNumber(item.matched[k])) return;
      const length = Math.hypot(c - a, d - b);
      visible += length;
      found += length * item.matched[k];
    });
    const share = visible ? found / visible : NaN;
    const bar = element("span", { class: "share", "aria-hidden": "true" }, element("i"));
    bar.firstChild.style.width = `${isNumber(share) ? 100 * share : 0}%`;
    const percent = isNumber(share) ? `${told(100 * share, 0)} %` : told(NaN);
    return element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, bar, percent), element("td", {}, told(visible, 0)));
  });
  $("parts").tBodies[0].replaceChildren(...rows);
}
function startWhy() {
  whyNow = 0;
  whyPictures = Object.fromEntries(["luma", "change", "edges"].map((name) => [name, new Pictures(why.map((item) => item[name]))]));
  $("why-none").hidden = why.length > 0;
  $("why-some").hidden = why.length === 0;
}

// Curves over time.

const restarts = (values, wraps) => values.map((value, row) => row > 0 && (track.walk[row] !== track.walk[row - 1] || (wraps && Math.abs(value - values[row - 1]) > 0.5)));
const MOTION = [
  { title: "X, along the ground", key: "x_m", unit: "m", digits: 2 },
  { title: "Y, depth", key: "y_m", unit: "m", digits: 2, least: 0.05 },
  { title: "Z, height of the torso's centre", key: "z_m", unit: "m", digits: 3 },
  { title: "Gait phase", key: "phase", unit: "", digits: 2, wraps: true, yRange: [0, 1] },
  { title: "Speed in the direction faced", key: "speed_mps", unit: "m/s", digits: 2 },
  { title: "Similarity of model and picture", key: "similarity", unit: "", digits: 2 },
  { title: "P(left and right swapped), of the whole walk", key: "p_swapped", unit: "", digits: 3, yRange: [0, 1] },
];
let curves = [];
function drawMotion() {
  curves = [];
  $("motion").replaceChildren();
  if (!track.frame.length) return;
  const strikes = events.filter(({ event }) => event === "heel_strike").map(({ time_s: x, side }) => ({ x, look: side, name: `heel strike, ${side}` }));
  const xRange = [track.time_s[0], track.time_s[track.time_s.length - 1]];
  for (const { key, wraps, ...spec } of MOTION) {
    const host = element("div");
    $("motion").append(host);
    const [ys, sds] = [track[key], track[`sd_${key}`]];
    const drawn = chart(host, {
      ...spec, xs: track.time_s, xRange, xLabel: "time, s", marks: strikes,
      curves: [{ ys, sds, gaps: restarts(ys, wraps) }],
      seek: (time) => player.seek(time),
    });
    curves.push((row) => {
      const spread = sds ? ` \u00B1 ${told(sds[row], spec.digits)}` : "";
      drawn.show(row === undefined ? times[player.at] : track.time_s[row], row === undefined ? [] : [ys[row]], row === undefined ? "" : `${told(ys[row], spec.digits)}${spread} ${spec.unit}`);
    });
  }
}

// Gait cycles.

const choice = $("cycle-walk");
const drawCycles = () => {
  const walk = Number(choice.value);
  const looks = ["right", "left"].map((side) => ({ name: side, look: side, of: (curve) => curve.walk === walk && curve.side === side }));
  cycleCharts($("cycles"), data.cycles, looks);
};
function startCycles() {
  const shown = data.cycles.walks.filter((walk) => walks.has(walk));
  choice.replaceChildren(...shown.map((walk) => element("option", { value: walk }, `walk ${walk}`)));
  $("cycle-choice").hidden = shown.length < 2;
  $("cycles-none").textContent = shown.length || !data.cycles.walks.length ? data.no_cycles : "This person has no measured cycles.";
  if (shown.length) drawCycles();
  else $("cycles").replaceChildren();
}
choice.addEventListener("change", drawCycles);

// One tab for each person.

function showPerson() {
  startWhy();
  drawMotion();
  startCycles();
  for (const part of document.querySelectorAll("[data-person]")) part.hidden = people.length > 1 && Number(part.dataset.person) !== person;
  for (const tab of $("people").children) {
    const isChosen = Number(tab.value) === person;
    tab.setAttribute("aria-selected", isChosen);
    tab.tabIndex = isChosen ? 0 : -1;
  }
  const first = frames.findIndex((frame) => rowOf.has(frame));
  if (frames.length) player.show(rowOf.has(frames[player.at]) ? player.at : Math.max(0, first));
}
for (const one of people.length > 1 ? people : []) {
  const tab = element("button", { type: "button", role: "tab", value: one }, `person ${one}`);
  tab.addEventListener("click", () => { choose(one); showPerson(); });
  tab.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const next = step && $("people").children[people.indexOf(one) + step];
    if (next) { next.focus(); next.click(); }
  });
  $("people").append(tab);
}
$("people").hidden = people.length < 2;

player.listeners.push(drawStage, () => {
  aim();
  view.draw();
  const row = rowNow();
  curves.forEach((show) => show(row));
  showWhy();
});
showPerson();
