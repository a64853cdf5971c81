// Reach within a part of the band: its bound at once, from what any law leaves line by line.

const OF_LAW = 2; // numbers that a free law takes at each line

const isSame = (one, other) => Boolean(one && other && one[0] === other[0] && one[1] === other[1]);

/** Kinds of ports with their reach: of the band that is chosen where it is known, or its bound. */
export function kindsOf({ reach, band, reachOfBand, model }) {
  if (!reach) return [];
  const kinds = (isSame(band, reachOfBand?.band) ? reachOfBand : reach).kinds.filter((kind) => !kind.is_channel && kind.curve.length);
  if (!band || isSame(band, reachOfBand?.band) || !reach.left) return kinds;
  const shares = boundWithin(reach, model.frequency, band);
  return kinds.map((kind) => bounded(kind, kind.rows.map((row) => shares[row])));
}

/** A kind of port of which only the bound of any law is known. */
function bounded(kind, shares) {
  const bound = Math.max(...shares);
  const curve = kind.curve.map((place, i) => ({ ...place, any_law: shares[i], few_numbers: null }));
  return { ...kind, curve, bound, best: { ...kind.best, place_m: curve[shares.indexOf(bound)].place_m } };
}

/** Share of the misfit of a band that any law could remove, for each place that was tried. */
function boundWithin({ given, left, measured }, frequency, [low, high]) {
  const [rows, lines] = left.shape;
  const inside = [];
  for (let line = 0; line < lines; line += 1) if (frequency[line] >= low && frequency[line] <= high) inside.push(line);
  const sum = (values, from) => inside.reduce((total, line) => total + values[from + line], 0);
  const misfit = sum(given, 0);
  const above = misfit - sum(measured, 0);
  const share = (row) => (above > 0 ? (misfit - sum(left, row * lines) - OF_LAW * inside.length) / above : 0);
  return Array.from({ length: rows }, (_, row) => Math.min(1, Math.max(0, share(row))));
}
