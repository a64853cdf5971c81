// What the background has found: where laws act, the law as measured, candidates, faults of the data.

import uPlot from "./vendor/uplot.js";
import { colour, element, make, percent, three } from "./look.js";

const MOST_PLACES = 8;
const LEAST = 1e-3; // probability from which on a candidate is listed

export class Learn {
  constructor(store, look) {
    this.store = store;
    this.look = look; // asks where something may act beside the model at hand
    this.share = {};
    this.waiting = make("div");
    this.plot = null;
  }

  show() {
    this.plot?.destroy();
    this.plot = null;
    const { reach, ledger, faults, next } = this.store;
    const parts = [];
    if (ledger) parts.push(...this.candidates(ledger));
    if (next) parts.push(...nextMeasurement(next));
    if (reach) parts.push(...this.places(reach));
    parts.push(this.waiting);
    if (faults?.sentences.length) parts.push(make("h3", {}, "The data themselves"), list(faults.sentences));
    element("learn").replaceChildren(...parts);
    this.wait();
    if (reach) this.law(reach);
  }

  /** What is on its way, alone: all else stays as it is read. */
  wait() {
    const shares = Object.entries(this.share);
    const waiting = shares.filter(([, { share }]) => share < 1).map(([task, { share }]) => `${WORDS[task] ?? task} … ${percent(share)}`);
    if (!this.store.reach && !waiting.length) waiting.push("The model is fitted as given, to see where something may act …");
    const told = shares.map(([, { words }]) => words).filter(Boolean);
    this.waiting.replaceChildren(...[...new Set([...waiting, ...told])].map((words) => make("p", { class: "waiting" }, words)));
  }

  background({ task, share, words }) {
    this.share[task] = { share, words };
    this.wait();
  }

  candidates(ledger) {
    const rows = Object.entries(ledger.probabilities)
      .sort((a, b) => b[1] - a[1])
      .filter(([, share], i) => i === 0 || share >= LEAST)
      .map(([kind, share]) => make("tr", {}, make("td", {}, kind.replaceAll("_", " ")), make("td", {}, bar(share)), make("td", {}, probability(share))));
    const compared = ledger.compared.slice(0, 6).map((row) => make("tr", {}, make("td", {}, row.effects), make("td", {}, three(row.chi2_per_datum)), make("td", {}, row.log_odds === null ? "–" : row.log_odds.toFixed(1))));
    return [
      make("h3", {}, "What is missing"),
      list(ledger.words),
      make("table", {}, ...rows),
      ...fallen(ledger.steps),
      make("details", {}, make("summary", {}, "Compared"), make("table", {}, make("tr", {}, make("th", {}, "effects"), make("th", {}, "χ²"), make("th", {}, "log odds")), ...compared)),
    ];
  }

  places(reach) {
    const rows = reach.kinds.map((kind) => {
      const place = kind.best.place_m.map((end) => `${end.map((v) => (1e3 * v).toFixed(0)).join(", ")} mm`).join(" to ");
      const where = kind.is_channel ? kind.best.setting : `${kind.acts_on} at ${place}`;
      const share = `removes ${percent(kind.few_numbers)}${kind.chance}`;
      return make("p", { class: "law" }, make("b", {}, kind.law_in_words), ` · ${where}`, make("small", {}, bar(kind.few_numbers), share));
    });
    this.chart = make("div", { id: "law" });
    const again = make("button", { onclick: this.look, title: "Where something may act beside the model at hand" }, "Look again");
    const head = make("div", { class: "row" }, make("small", { class: "hint" }, reach.of === "as drawn" ? "beside the model as given" : `beside step “${reach.of}”`), again);
    return [make("h3", {}, "Where something may act, whatever it is"), head, ...rows, make("h3", { id: "law-title" }), this.chart];
  }

  /** The law that the data ask for at the best kind of port, with the network through it. */
  law(reach) {
    const kind = reach.kinds.find((each) => each.measured?.real.some((value) => value));
    if (!kind || !this.chart.isConnected) return;
    const { measured } = kind;
    const size = (real, imaginary) => real.map((re, i) => Math.hypot(re, imaginary[i]) || null);
    const dots = size(measured.real, measured.imaginary);
    const spread = size(measured.deviation_real, measured.deviation_imaginary);
    const low = dots.map((value, i) => Math.max(value - spread[i], value / 10));
    const high = dots.map((value, i) => value + spread[i]);
    const axis = { stroke: colour("--faint"), grid: { stroke: colour("--line") }, ticks: { stroke: colour("--line") }, font: "11px system-ui", labelFont: "12px system-ui", splits: powers, values: inPowers, filter: (_, ticks) => ticks };
    const values = [...dots].filter(Boolean).sort((a, b) => a - b);
    const range = [values[Math.floor(values.length * 0.02)] / 2, values[Math.floor(values.length * 0.98)] * 2];
    element("law-title").textContent = `Law at the ${kind.acts_on}: ${kind.law_in_words}`;
    this.plot = new uPlot({
      width: this.chart.clientWidth || 300, height: 190, legend: { show: false }, cursor: { show: false },
      scales: { x: { time: false, distr: 3 }, y: { distr: 3, range } },
      axes: [{ ...axis, label: "frequency [Hz]", labelSize: 16, size: 26 }, { ...axis, label: measured.unit, labelSize: 16, size: 44 }],
      bands: [{ series: [2, 1], fill: colour("--band") }],
      series: [{}, { stroke: "transparent", points: { show: false } }, { stroke: "transparent", points: { show: false } },
        { paths: () => null, points: { show: true, size: 3.4, fill: colour("--data"), stroke: colour("--data") } },
        { stroke: colour("--fitted"), width: 1.6, points: { show: false } }],
    }, [measured.frequency, low, high, dots, size(measured.law_real, measured.law_imaginary)], this.chart);
  }
}

const WORDS = { as_given: "Fitting as given", band: "Looking where something acts in this band", reach: "Looking where something may act", check_data: "Checking the data", next: "Searching where to measure next" };

/** Steps of a search: the error as it fell, and the model error that is needed with each. */
function fallen(steps) {
  const kinds = [...new Set(steps.flatMap(({ model_error: sizes }) => Object.keys(sizes)))];
  const head = ["step", "χ²", ...kinds].map((words) => make("th", {}, words));
  const rows = steps.map(({ added, words, chi2, model_error: sizes }) => {
    const needed = kinds.map((kind) => make("td", {}, sizes[kind] === undefined ? "–" : `${three(100 * sizes[kind])} %`));
    return make("tr", {}, make("td", { title: words }, added ? `+ ${added}` : "as given"), make("td", {}, three(chi2)), ...needed);
  });
  return [make("table", { "aria-label": "Steps of the search, with the model error needed" }, make("tr", {}, ...head), ...rows)];
}

/** Where one more measurement would decide most, with the gain of each place that was tried. */
function nextMeasurement({ sentence, columns, rows, caption }) {
  const most = Math.max(...rows.map((row) => row.at(-2)), 1e-9);
  const cells = (row) => row.map((value, i) => make("td", {}, i === row.length - 2 ? bar(Math.max(0, value) / most) : "", ` ${three(value)}`));
  const body = rows.slice(0, MOST_PLACES).map((row) => make("tr", {}, ...cells(row)));
  const table = make("table", {}, make("tr", {}, ...columns.map((name) => make("th", {}, name))), ...body);
  const tried = rows.length ? [make("details", {}, make("summary", {}, "Places that were tried"), table, make("p", { class: "hint" }, caption))] : [];
  return [make("h3", {}, "Where to measure next"), make("p", { class: "law" }, sentence), ...tried];
}

const probability = (share) => (share < LEAST ? "<\u00a00.001" : share.toPrecision(2));

/** Powers of ten within a logarithmic axis. */
const powers = (u, axis) => {
  const { min, max } = u.scales[u.axes[axis].scale];
  const first = Math.ceil(Math.log10(min));
  return Array.from({ length: Math.max(0, Math.floor(Math.log10(max)) - first + 1) }, (_, i) => 10 ** (first + i));
};
const inPowers = (_, ticks) => ticks.map((t) => (t >= 1e-3 && t < 1e4 ? String(t) : `1e${Math.round(Math.log10(t))}`));

const list = (sentences) => make("ul", {}, ...sentences.map((sentence) => make("li", {}, sentence)));

function bar(share) {
  const made = make("span", { class: "bar" });
  made.style.width = `${Math.max(1, 60 * share)}px`;
  return made;
}
