// What is drawn of an output: decibels, phase, parts, from the numbers of single precision.

const TURN = 180 / Math.PI;

/** Parts [part][line] of one pair out of an array [pair, part, line]. */
export function partsOf(array, pair) {
  const [, parts, lines] = array.shape;
  const begin = pair * parts * lines;
  return Array.from({ length: parts }, (_, part) =>
    array.subarray(begin + part * lines, begin + (part + 1) * lines),
  );
}

/** Row of one pair out of an array [pair, line]. */
export function rowOf(array, pair) {
  const lines = array.shape[1];
  return array.subarray(pair * lines, (pair + 1) * lines);
}

const plain = (values, scale = 1) => Array.from(values, (v) => (Number.isFinite(v) ? scale * v : null));

function decibels(parts) {
  if (parts.length === 1) return plain(parts[0], 20); // log10 of the amplitude
  return Array.from(parts[0], (re, i) => {
    const size = Math.hypot(re, parts[1][i]);
    return size > 0 ? 20 * Math.log10(size) : null;
  });
}

function phase(parts) {
  const angles = Array.from(parts[0], (re, i) => {
    const angle = TURN * Math.atan2(parts[1][i], re);
    return Number.isFinite(angle) ? angle : null;
  });
  // No line from one end of the axis to the other: a jump is a gap.
  return angles.map((a, i) => (i && a !== null && Math.abs(a - angles[i - 1]) > 180 ? null : a));
}

function amplitude(parts, i) {
  return Math.hypot(parts[0][i], parts[1][i]);
}

/** Half width of the noise at a line, of the quantity that is drawn. */
const WIDTH = {
  decibels: (measured, deviation, i) => {
    if (measured.length === 1) return 20 * deviation[0][i];
    return (20 / Math.LN10) * Math.min(1, deviation[0][i] / amplitude(measured, i));
  },
  phase: (measured, deviation, i) => Math.min(180, TURN * (deviation[0][i] / amplitude(measured, i))),
  real: (measured, deviation, i) => deviation[0][i],
  imaginary: (measured, deviation, i) => deviation[1][i],
};

const QUANTITIES = {
  decibels: { of: decibels, name: (unit) => `dB re 1 ${unit}`, unit: "dB" },
  phase: { of: phase, name: () => "phase [°]", unit: "°" },
  real: { of: (parts) => plain(parts[0]), name: (unit) => `real [${unit}]`, unit: "" },
  imaginary: { of: (parts) => plain(parts[1]), name: (unit) => `imaginary [${unit}]`, unit: "" },
  coherence: { of: (parts) => plain(parts[0]), name: () => "coherence [1]", unit: "" },
};

/** Views of complex outputs and of amplitudes: quantities one below the other. */
export const VIEWS = {
  "dB and phase": ["decibels", "phase"],
  dB: ["decibels"],
  "real and imaginary": ["real", "imaginary"],
  Nyquist: [],
  coherence: ["coherence"],
};

export function viewsOf(model) {
  const names = model.measured.shape[1] === 1 ? ["dB", "coherence"] : Object.keys(VIEWS);
  return names.filter((name) => name !== "coherence" || model.coherence);
}

export function drawn(quantity, parts) {
  return QUANTITIES[quantity].of(parts);
}

export function axisName(quantity, unit) {
  return QUANTITIES[quantity].name(unit);
}

export function unitOf(quantity, unit) {
  return QUANTITIES[quantity].unit || unit;
}

/** Lower and upper end of the noise about what was measured. */
export function noiseBand(quantity, measured, deviation) {
  const middle = drawn(quantity, measured);
  const width = middle.map((value, i) => (value === null ? null : WIDTH[quantity](measured, deviation, i)));
  return [
    middle.map((value, i) => (value === null ? null : value - width[i])),
    middle.map((value, i) => (value === null ? null : value + width[i])),
  ];
}
