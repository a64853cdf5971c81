// Reach at once: within a band that is chosen, and beside the model as it stands, all else held.

const OF_LAW = 2; // numbers that a free law takes at each line

const WHOLE = [0, Infinity]; // [Hz]

const isSame = (one, other) => Boolean(one && other && one[0] === other[0] && one[1] === other[1]);

/** Kinds of ports with their reach: of the chosen band where it is known, or what any law could remove. */
export function kindsOf({ reach, band, reachOfBand, bound, beside }) {
  if (!reach) return [];
  const isOfBand = isSame(band, reachOfBand?.band) && !beside;
  const kinds = (isOfBand ? reachOfBand : reach).kinds.filter((kind) => !kind.is_channel && kind.curve.length);
  if (beside) {
    const shares = sharesWithin(beside, beside.frequency, band ?? WHOLE);
    const curve = beside.places.map((place_m) => ({ place_m }));
    return kinds.map((kind) => (kind.acts_on === beside.acts_on ? byAnyLaw({ ...kind, curve }, shares) : kind));
  }
  if (!band || isOfBand || !bound?.shares.length) return kinds;
  return kinds.map((kind) => byAnyLaw(kind, kind.rows.map((row) => bound.shares[row])));
}

/** A kind of port of which is known what any law could remove. */
function byAnyLaw(kind, shares) {
  const most = Math.max(...shares);
  const curve = kind.curve.map((place, i) => ({ ...place, any_law: shares[i], few_numbers: null }));
  return { ...kind, curve, any_law: most, best: { ...kind.best, place_m: curve[shares.indexOf(most)].place_m } };
}

/** Share of the misfit of a band that any law could remove, for each place that was tried. */
function sharesWithin({ given, left, measured }, frequency, [low, high]) {
  const [rows, lines] = left.shape;
  const inside = [];
  for (let line = 0; line < lines; line += 1) if (frequency[line] >= low && frequency[line] <= high) inside.push(line);
  const sum = (values, from) => inside.reduce((total, line) => total + values[from + line], 0);
  const misfit = sum(given, 0);
  const above = misfit - sum(measured, 0);
  const share = (row) => (above > 0 ? (misfit - sum(left, row * lines) - OF_LAW * inside.length) / above : 0);
  return Array.from({ length: rows }, (_, row) => Math.min(1, Math.max(0, share(row))));
}
