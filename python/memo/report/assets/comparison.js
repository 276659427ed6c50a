// The page of two walks.

for (const side of ["right", "left"]) {
  const looks = ["a", "b"].map((of) => ({ name: of.toUpperCase(), look: of, of: (curve) => curve.of === of && curve.side === side }));
  cycleCharts($(side), data.cycles, looks);
}
