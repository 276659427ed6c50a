// The page of postures from one view: the image points, the most probable motion, and the alternatives.

const { joints, frames, second } = data;
const player = new Player(frames.map(({ time_s: time }) => time), (index) => `frame ${frames[index].frame}, ${told(frames[index].time_s, 2)} s`);
const jointAt = new Map(joints.map((name, index) => [name, index]));
const now = () => frames[player.at];
const BONES = ["right", "left"].flatMap((side) => [["neck", "shoulder"], ["shoulder", "elbow"], ["elbow", "wrist"], ["pelvis", "hip"], ["hip", "knee"], ["knee", "ankle"]]
  .map((ends) => [side, ends.map((end) => (["neck", "pelvis"].includes(end) ? end : `${side}_${end}`))]))
  .concat([["body", ["neck", "pelvis"]]]);

// The image points, in pixels; the part of the picture that all frames need.

const seen = frames.flatMap((frame) => frame.points_px).filter((point) => known(point));
const extent = [0, 1].map((axis) => {
  const values = seen.map((point) => point[axis]);
  return values.length ? [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))] : [0, 1];
});
const side = Math.max(...extent.map(([low, high]) => high - low), 1) * 1.12;
const centre = extent.map(([low, high]) => (low + high) / 2);

const drawPoints = drawnCanvas($("points"), () => (view.canvas.clientWidth < 500 ? 1.1 : 4 / 3), (context, width, height) => {
  const { rim, body, right, left, soft } = palette();
  const colours = { right, left, body };
  const factor = Math.min(width, height) / side;
  const place = ([u, v]) => [width / 2 + (u - centre[0]) * factor, height / 2 + (v - centre[1]) * factor];
  const frame = now();
  if (!frame) return;
  for (const [which, names] of BONES) {
    const [a, b] = names.map((name) => jointAt.get(name));
    const ends = [frame.points_px[a], frame.points_px[b]];
    if (!known(...ends)) continue;
    context.globalAlpha = Math.max(0.15, Math.min(frame.weights[a] ?? 0, frame.weights[b] ?? 0, 1));
    context.strokeStyle = colours[which];
    context.lineWidth = 3;
    context.lineCap = "round";
    context.beginPath();
    context.moveTo(...place(ends[0]));
    context.lineTo(...place(ends[1]));
    context.stroke();
  }
  frame.points_px.forEach((point, index) => {
    if (!known(point)) return;
    context.globalAlpha = Math.max(0.25, Math.min(frame.weights[index] ?? 0, 1));
    context.fillStyle = joints[index].startsWith("right") ? right : joints[index].startsWith("left") ? left : rim === "#0b0d0f" ? soft : rim;
    context.beginPath();
    context.arc(...place(point), 4, 0, 2 * Math.PI);
    context.fill();
  });
  context.globalAlpha = 1;
});

// In 3D: the most probable motion, and beside it an alternative, transparent.

const other = $("other");
const most = frames.reduce((count, frame) => Math.max(count, frame.groups_m.length), 0);
for (const [value, words] of [
  ["none", "nothing"],
  ...(second ? [["second", "second-best motion"]] : []),
  ["linked", "before smoothing"],
  ...Array.from({ length: most }, (_, k) => [`${k}`, `group ${k + 1} of postures left`]),
]) other.append(element("option", { value }, words));
if (second) other.value = "second";

/** The other posture of this frame as 14 points, or null. */
function otherPosture() {
  const frame = now();
  if (!frame || other.value === "none") return null;
  if (other.value === "linked") return frame.linked_m;
  if (other.value === "second") return second.at[frame.frame] ?? null;
  return frame.groups_m[Number(other.value)] ?? null;
}

const view = new View3D($("view"), (self) => {
  const frame = now();
  if (!frame) return;
  const of = (points) => (name) => (known(points[jointAt.get(name)]) ? points[jointAt.get(name)] : null);
  figure(self, of(frame.smoothed_m));
  const ghost = otherPosture();
  if (ghost) figure(self, of(ghost), { opacity: 0.55, thickness: 0.55, plain: palette().accent });
});

function aim() {
  const points = ($("follow").checked ? [now()] : frames).flatMap((frame) => frame?.smoothed_m ?? []).filter((point) => known(point));
  if (!points.length) return;
  const [x, y, z] = mean(points);
  view.target = [x, y, $("follow").checked ? z : Math.max(0.5, z)];
}
$("follow").addEventListener("change", () => {
  view.distance = $("follow").checked ? view.home.distance : view.home.distance * 1.8;
  aim();
  view.draw();
});
other.addEventListener("change", () => player.show(player.at));
$("views").addEventListener("click", (event) => {
  const at = (name) => now()?.smoothed_m[jointAt.get(name)];
  const across = known(at("right_hip"), at("left_hip")) ? difference(at("left_hip"), at("right_hip")) : [0, 1, 0];
  const heading = Math.atan2(across[1], across[0]) - Math.PI / 2; // the left hip is to the left
  const chosen = { side: [heading - Math.PI / 2, 0.02], front: [heading, 0.1], top: [heading - Math.PI / 2, 1.55] }[event.target.dataset?.view];
  if (chosen) view.from(...chosen);
});

// Texts and numbers of the frame.

function showFrame() {
  const frame = now();
  $("frame-now").textContent = `frame ${frame.frame}`;
  const lines = [];
  if (frame.problem) lines.push(`This frame cannot be used: ${frame.problem}`);
  const count = frame.group_count === null ? "" : `, in ${frame.group_count} groups`;
  lines.push(`${frame.survivors} postures left${count}.`);
  for (const broken of frame.cut_all ?? []) lines.push(`No posture is left; the least violating posture: ${broken}`);
  lines.push(frame.linked_breaks?.length ? `The posture in the motion breaks: ${frame.linked_breaks.map((name) => name.replaceAll("_", " ")).join(", ")}.` : "The posture in the motion breaks no constraint.");
  lines.push(isNumber(frame.margin_nats) ? `Margin between this motion and the best one that differs in this frame: ${told(frame.margin_nats, 2)} nats.` : "No other motion is possible in this frame.");
  $("frame-told").replaceChildren(...lines.map((line) => element("li", {}, line)));
  const rows = joints.map((name, index) => {
    const p = frame.p_mirrored[index];
    const bar = element("span", { class: "share", "aria-hidden": "true" }, element("i"));
    bar.firstChild.style.width = `${isNumber(p) ? 100 * p : 0}%`;
    const point = frame.smoothed_m[index] ?? [];
    const cells = [[bar, told(p, 2)], [told(100 * (frame.sd_m[index] ?? NaN), 1)], [told(100 * (frame.gap_m[index] ?? NaN), 1)], ...[0, 1, 2].map((axis) => [told(point[axis], 3)])];
    return element("tr", {}, element("th", { scope: "row" }, name.replaceAll("_", " ")), ...cells.map((cell) => element("td", {}, ...cell)));
  });
  $("joints").tBodies[0].replaceChildren(...rows);
  const note = { none: "", second: second ? `Green: the second-best motion; it differs in frames ${second.first_frame} to ${second.last_frame} (${second.joints.map((name) => name.replaceAll("_", " ")).join(", ")}), probability ${told(second.p, 2)}.` : "", linked: "Green: the same motion before smoothing." }[other.value];
  $("other-note").textContent = (note ?? "Green: one posture of the group.") + (other.value !== "none" && !otherPosture() ? " None in this frame." : "");
}

// Over time.

const times = frames.map(({ time_s: time }) => time);
const drawn = [
  ["Postures left", "", 0, frames.map(({ survivors }) => survivors), undefined],
  ["Margin to the best motion that differs in the frame", "nats", 2, frames.map(({ margin_nats: margin }) => margin), undefined],
  ["Largest P(mirrored) of all joints", "", 2, frames.map(({ p_mirrored: p }) => (p.some(isNumber) ? Math.max(...p.filter(isNumber)) : null)), [0, 1]],
  ["Distance of the neck from the camera", "m", 2, frames.map(({ anchor_m: anchor }) => anchor), undefined, frames.map(({ anchor_sd_m: sd }) => sd)],
].map(([title, unit, digits, ys, yRange, sds]) => {
  const host = element("div");
  $("charts").append(host);
  const made = chart(host, { title, unit, digits, xs: times, xRange: [times[0] ?? 0, times[times.length - 1] ?? 1], xLabel: "time, s", yRange, least: 0.01, curves: [{ ys, sds }], seek: (time) => player.seek(time) });
  return (index) => made.show(times[index], [ys[index]], `${told(ys[index], digits)} ${unit}`);
});

player.listeners.push((index) => {
  aim();
  view.draw();
  drawPoints();
  showFrame();
  drawn.forEach((show) => show(index));
});
const firstFound = frames.findIndex((frame) => frame.smoothed_m.some((point) => known(point)));
if (frames.length) player.show(second && frames.some(({ frame }) => frame === second.first_frame) ? frames.findIndex(({ frame }) => frame === second.first_frame) : Math.max(0, firstFound));
