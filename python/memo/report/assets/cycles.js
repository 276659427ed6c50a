// Gait cycles: single ones thin, means thick with their 95 % intervals, before the band of average walking.

const JOINT_TITLES = { hip: "Hip", knee: "Knee", ankle: "Ankle" };
const PERCENT = Array.from({ length: 101 }, (_, percent) => percent);

/** What the mean of a person or side is at a point, in words. */
function cycleWords({ name, mean }, percent) {
  if (!mean || !isNumber(mean.ys[percent])) return `${name} ${told(NaN)}`;
  const half = isNumber(mean.half[percent]) ? ` \u00B1 ${told(mean.half[percent], 1)}` : "";
  return `${name} ${told(mean.ys[percent], 1)}${half}\u00B0`;
}

/**
 * A chart of a joint in `host`. `shown`: [{name, look, curves, mean}], one per colour; `band` as in the data of a page.
 */
function cycleChart(host, joint, title, shown, band) {
  const counted = shown.map(({ name, mean }) => `${name}: ${mean ? mean.n : 0}`).join(", ");
  const singles = shown.flatMap(({ look, curves }) => curves.map(({ ys }) => ({ ys, look: `${look} thin` })));
  const means = shown.flatMap(({ look, mean }) => (mean ? [{ ys: mean.ys, sds: mean.half, look: `${look} thick` }] : []));
  chart(host, {
    title, unit: "\u00B0", digits: 1, height: 230, xs: PERCENT, xRange: [0, 100], xLabel: "% of the cycle",
    band: band[joint] && { xs: band.percent, ys: band[joint], sds: band[`${joint}_sd`] },
    curves: [...singles, ...means], least: 2, words: `cycles: ${counted}`,
    hover: (x) => {
      const percent = Math.round(x);
      const known = band[joint] ? `, average ${told(band[joint][percent], 1)}\u00B0` : "";
      const words = `${percent} %: ${shown.map((one) => cycleWords(one, percent)).join(", ")}${known}`;
      return { x: percent, ys: shown.map(({ mean }) => mean?.ys[percent]), words };
    },
  });
}

/** The charts of all joints in `host`. `looks`: [{name, look, of}], of(curve) selects the curves of a colour. */
function cycleCharts(host, cycles, looks) {
  host.replaceChildren();
  for (const [joint, title] of Object.entries(JOINT_TITLES)) {
    const shown = looks.map(({ name, look, of }) => {
      const curves = cycles.curves.filter((curve) => curve.joint === joint && of(curve));
      const known = (curve) => curve.ys.some(isNumber);
      return { name, look, curves: curves.filter((curve) => curve.curve !== "mean"), mean: curves.find((curve) => curve.curve === "mean" && known(curve)) };
    });
    const chartHost = element("div");
    host.append(chartHost);
    cycleChart(chartHost, joint, title, shown, cycles.band);
  }
}
