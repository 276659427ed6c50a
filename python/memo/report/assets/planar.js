// The page of limbs found in dots: the dots, the links, and their depths.

const { names, frames, windows, links, chains } = data;
const at = new Map(names.map((name, index) => [name, index]));
const player = new Player(frames.map(({ time_s: time }) => time), (index) => `frame ${frames[index].frame}, ${told(frames[index].time_s, 2)} s`);
const now = () => frames[player.at];

/** The window of this frame: an interpreted one if possible, with the middle nearest to the frame. */
function windowNow() {
  const time = now()?.time_s;
  const off = ({ start_s: start, end_s: end }) => Math.abs((start + end) / 2 - time);
  const holding = windows.filter(({ start_s: start, end_s: end }) => start <= time && time <= end);
  const read = holding.filter(({ status }) => status === "interpreted");
  return (read.length ? read : holding).sort((a, b) => off(a) - off(b))[0]?.window;
}

const seen = frames.flatMap(({ points }) => points.filter(([u, v]) => isNumber(u) && isNumber(v)));
const extent = [0, 1].map((axis) => seen.reduce(([low, high], point) => [Math.min(low, point[axis]), Math.max(high, point[axis])], [Infinity, -Infinity]));
if (!seen.length) extent.splice(0, 2, [0, 1], [0, 1]);
const [wide, high] = extent.map(([from, to]) => Math.max(1, to - from));
const verdictLook = { planar: ["accent", []], undecided: ["soft", []], refuted: ["soft", [3, 4]] };

const drawPoints = drawnCanvas($("points"), () => 4 / 3, (context, width, height) => {
  const colours = palette();
  const factor = Math.min(width / (wide * 1.12), height / (high * 1.12));
  const place = ([u, v]) => [width / 2 + (u - (extent[0][0] + extent[0][1]) / 2) * factor, height / 2 + (v - (extent[1][0] + extent[1][1]) / 2) * factor];
  const points = now()?.points ?? [];
  const window = windowNow();
  for (const link of $("show-links").checked ? links.filter((other) => other.window === window) : []) {
    const ends = [points[at.get(link.a)], points[at.get(link.b)]].map((point) => point?.slice(0, 2));
    if (!known(...ends)) continue;
    const [colour, dash] = verdictLook[link.verdict] ?? verdictLook.undecided;
    context.strokeStyle = colours[colour];
    context.lineWidth = 3;
    context.setLineDash(dash);
    context.beginPath();
    context.moveTo(...place(ends[0]));
    context.lineTo(...place(ends[1]));
    context.stroke();
    context.setLineDash([]);
  }
  context.fillStyle = colours.ink;
  for (const point of points) {
    if (!known(point.slice(0, 2))) continue;
    context.beginPath();
    context.arc(...place(point), 4, 0, 2 * Math.PI);
    context.fill();
  }
});
$("show-links").addEventListener("change", drawPoints);

// In depth: u to the right, depth away, v down; scaled to the size of a person.

const mirrored = new Set();
const chainNames = [...new Set(chains.map(({ chain }) => chain))];
for (const chain of chainNames) {
  const box = element("input", { type: "checkbox" });
  box.addEventListener("change", () => {
    if (box.checked) mirrored.add(chain);
    else mirrored.delete(chain);
    view.draw();
  });
  $("mirrors").append(element("label", {}, box, ` mirror ${chain}`));
}

const scale = 1.7 / high;
/** A point as [right, away, up], with mirrored depth if its chain is mirrored; without a depth, in the plane of the picture. */
function placed(index) {
  const [u, v, depth] = now().points[index] ?? [];
  if (!isNumber(u) || !isNumber(v)) return null;
  const turned = [...mirrored].some((chain) => `-${chain}-`.includes(`-${names[index]}-`));
  return [(u - (extent[0][0] + extent[0][1]) / 2) * scale, (depth ?? 0) * (turned ? -1 : 1) * scale, (extent[1][1] - v) * scale];
}

const view = new View3D($("view"), (self) => {
  if (!now()) return;
  const colours = palette();
  const window = windowNow();
  for (const link of links.filter((other) => other.window === window && other.verdict !== "refuted")) {
    const ends = [at.get(link.a), at.get(link.b)].map(placed);
    self.limb(...ends, 0.028, link.verdict === "planar" ? colours.accent : colours.body, colours.rim);
  }
  names.forEach((_, index) => {
    const depth = isNumber(now().points[index]?.[2]);
    self.ball(placed(index), 0.035, depth ? colours.ink : colours.body, colours.rim, depth ? 1 : 0.5);
  });
});
Object.assign(view, { yaw: -0.9, pitch: 0.15, distance: 3.2, target: [0, 0, 0.85] });
$("views").addEventListener("click", (event) => {
  const chosen = { front: [-Math.PI / 2, 0], side: [0, 0.05], top: [-Math.PI / 2, 1.55] }[event.target.dataset?.view];
  if (chosen) view.from(...chosen);
});

player.listeners.push(drawPoints, () => {
  const places = names.map((_, index) => placed(index)).filter((point) => known(point));
  if (places.length) view.target = [mean(places)[0], 0, 0.85];
  view.draw();
});
if (frames.length) player.show(0);
