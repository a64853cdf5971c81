// Charts of the channels that are shown: measured points with noise, curves, error; all are linked.

import uPlot from "./vendor/uplot.js";
import { CURVES, colour, element, make, oncePerFrame, renew, three } from "./look.js";
import { drawNyquist } from "./nyquist.js";
import { VIEWS, axisName, drawn, noiseBand, partsOf, rowOf, unitOf, viewsOf } from "./quantities.js";

const HEIGHT = { decibels: 210, coherence: 160, real: 160, imaginary: 160, phase: 100, error: 120 };
const LEAST_WIDTH = 4; // pixels from which on a band is meant
const LEAST_ERROR = 0.1;
const CROWDED = 0.2; // share of the band in which half of the lines crowd: as in the figures

export class Curves {
  /** `store` has model, curves by name, and the numbers of the pairs that are shown. */
  constructor(store, onRange, onBand) {
    Object.assign(this, { store, onRange, onBand }); // a band that is shown; one that is being chosen
    this.view = "";
    this.hidden = new Set();
    this.charts = []; // { plot, pair, quantity, readout }
    this.range = null;
    this.refresh = oncePerFrame(() => this.setData());
    new ResizeObserver(oncePerFrame(() => this.resize())).observe(element("charts"));
    element("whole").onclick = () => this.zoom(null);
    element("charts").addEventListener("keydown", (event) => this.key(event));
  }

  begin() {
    const views = viewsOf(this.store.model);
    this.view = views.includes(this.view) ? this.view : views[0];
    renew(element("views"), ...views.map((view) => this.chip(view)));
    this.legend();
    this.build();
  }

  chip(view) {
    const press = () => {
      this.view = view;
      this.begin();
    };
    return make("button", { "aria-pressed": String(view === this.view), onclick: press }, view);
  }

  legend() {
    renew(element("legend"), ...["measured", ...CURVES.map((curve) => curve.name)].map((name) => this.toggle(name)));
  }

  toggle(name) {
    const swatch = make("i");
    const curve = CURVES.find((each) => each.name === name);
    swatch.style.setProperty("--swatch", `var(${curve ? curve.colour : "--data"})`);
    const press = () => {
      this.hidden[this.hidden.has(name) ? "delete" : "add"](name);
      this.legend();
      this.setData();
    };
    const isKnown = !curve || name in this.store.curves; // others keep the place of those that come
    const label = this.named(name);
    return make("button", { "aria-pressed": String(isKnown && !this.hidden.has(name)), disabled: !isKnown, title: label, onclick: press }, swatch, label);
  }

  named(name) {
    return name === "now" ? "as it stands" : this.store.curves[name]?.title || name;
  }

  /** Make the charts of all shown channels anew. */
  build() {
    this.charts.forEach(({ plot }) => plot?.destroy());
    this.charts = [];
    const parts = this.store.shown.map((pair) => this.channel(pair));
    element("charts").replaceChildren(...parts);
    this.charts.filter((chart) => !chart.plot && chart.quantity !== "nyquist").forEach((chart) => this.plot(chart));
    this.setData();
  }

  channel(pair) {
    const { sensor, actuator, level } = this.store.model.pairs[pair];
    const title = `${sensor} / ${actuator}${level === null ? "" : `, ${level} N`}`;
    const quantities = this.view === "Nyquist" ? ["nyquist"] : [...VIEWS[this.view], "error"];
    const cells = quantities.length === 1 ? [] : Array.from({ length: CURVES.length + 3 }, () => make("span"));
    const readout = make("div", { class: "readout" }, ...cells); // its place is kept while the cursor is elsewhere
    const box = make("div", { class: "chart" }, make("h3", {}, title), readout);
    for (const quantity of quantities) {
      const holder = quantity === "nyquist" ? make("canvas", { class: "nyquist" }) : make("div");
      box.append(holder);
      this.charts.push({ pair, quantity, readout, holder, plot: null });
    }
    return box;
  }

  plot(chart) {
    const { model } = this.store;
    const isError = chart.quantity === "error";
    const isLast = isError;
    const width = chart.holder.clientWidth || 400;
    const unit = model.unit.slice(model.unit.lastIndexOf("[") + 1, -1);
    const axis = { stroke: colour("--faint"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line") } };
    const name = isError ? "error [σ]" : axisName(chart.quantity, unit);
    const options = {
      width,
      height: HEIGHT[chart.quantity] + (isLast ? 26 : 0),
      padding: [8, 22, 0, 0],
      legend: { show: false },
      cursor: { sync: { key: "frequency", scales: ["x", null] }, drag: { x: true, y: false, setScale: false }, points: { size: 6 } },
      scales: {
        x: { time: false, distr: this.isLogarithmic() ? 3 : 1 },
        y: isError ? { distr: 3, range: (_, low, high) => [LEAST_ERROR, Math.max(10, high * 1.3)] } : this.scale(chart),
      },
      axes: [
        { ...axis, label: isLast ? "frequency [Hz]" : undefined, labelSize: isLast ? 18 : 0, size: isLast ? 30 : 14,
          labelFont: "12px system-ui", font: "11px system-ui", values: isLast ? undefined : (_, ticks) => ticks.map(() => "") },
        { ...axis, label: name, labelSize: 18, size: 52, labelFont: "12px system-ui", font: "11px system-ui",
          incrs: chart.quantity === "phase" ? [90, 180] : undefined, space: 26,
          splits: isError ? (u) => [-1, 0, 1, 2, 3, 4, 5, 6].map((power) => 10 ** power).filter((t) => t <= u.scales.y.max) : undefined,
          filter: isError ? (_, ticks) => ticks : undefined,
          values: isError ? (_, ticks) => ticks.map((t) => (t < 1e4 ? String(t) : `1e${Math.round(Math.log10(t))}`)) : undefined },
      ],
      series: this.series(isError),
      bands: isError ? [] : [{ series: [2, 1], fill: colour("--band") }],
      hooks: {
        drawClear: isError ? [(u) => shadeNoise(u)] : [],
        setCursor: [(u) => this.readouts(u), (u) => this.choosing(u)],
        setSelect: [(u) => this.selected(u)],
        ready: [(u) => this.listen(u)],
      },
    };
    chart.plot = new uPlot(options, this.dataOf(chart), chart.holder);
  }

  /** Axis by what was measured, so that it stands still while a curve is moved. */
  scale(chart) {
    if (chart.quantity === "phase") return { range: [-198, 198] };
    if (chart.quantity === "coherence") return { range: [0, 1.05] };
    const [low, high] = [0, 1].map((side) => noiseBand(chart.quantity, ...this.measuredOf(chart.pair))[side]);
    return {
      range: (u) => {
        const [begin, end] = this.range ?? [-Infinity, Infinity];
        const inside = (_, i) => u.data[0][i] >= begin && u.data[0][i] <= end;
        const least = Math.min(...low.filter(inside).filter((v) => v !== null));
        const most = Math.max(...high.filter(inside).filter((v) => v !== null));
        if (!Number.isFinite(least + most)) return [0, 1];
        const room = 0.18 * (most - least) || 1;
        return [least - room, most + room];
      },
    };
  }

  series(isError) {
    const lines = CURVES.map(({ colour: variable, width, dash }) => ({ stroke: colour(variable), width, dash, points: { show: false } }));
    if (isError) return [{}, ...lines];
    const edge = { stroke: "transparent", points: { show: false } };
    const dots = { stroke: colour("--data"), fill: colour("--data"), paths: () => null, points: { show: true, size: 3.6, fill: colour("--data") } };
    return [{}, edge, edge, dots, ...lines];
  }

  measuredOf(pair) {
    const { model, curves } = this.store;
    return [partsOf(model.measured, pair), partsOf((curves.now ?? curves["as drawn"]).deviation, pair)];
  }

  dataOf({ pair, quantity }) {
    const { model, curves } = this.store;
    const x = (this.store.x ??= Array.from(model.frequency));
    const none = CURVES.map(() => x.map(() => null));
    if (quantity === "coherence") return [x, none[0], none[0], Array.from(rowOf(model.coherence, pair)), ...none];
    const isShown = (name) => curves[name] && !this.hidden.has(name);
    const nothing = x.map(() => null);
    const error = (name) => Array.from(rowOf(curves[name].error, pair), (v) => (v > 0 ? Math.max(v, LEAST_ERROR) : null));
    const value = (name) => drawn(quantity, partsOf(curves[name].predicted, pair));
    const lines = CURVES.map(({ name }) => (isShown(name) ? (quantity === "error" ? error(name) : value(name)) : nothing));
    if (quantity === "error") return [x, ...lines];
    const measured = this.measuredOf(pair);
    const points = this.hidden.has("measured") ? nothing : drawn(quantity, measured[0]);
    const band = this.hidden.has("measured") ? [nothing, nothing] : noiseBand(quantity, ...measured);
    return [x, ...band, points, ...lines];
  }

  setData() {
    if (!this.store.model || !this.store.curves.now) return;
    for (const chart of this.charts) {
      if (chart.quantity === "nyquist") drawNyquist(chart.holder, this, chart.pair);
      else if (chart.plot) {
        chart.plot.setData(this.dataOf(chart), false);
        this.setRange(chart.plot);
      }
    }
  }

  isLogarithmic() {
    const x = this.store.model.frequency;
    return x[0] > 0 && x[Math.floor(x.length / 2)] < CROWDED * x[x.length - 1];
  }

  whole() {
    const x = this.store.model.frequency;
    return x.length > 1 ? [x[0], x[x.length - 1]] : [x[0] - 1, x[0] + 1];
  }

  /** Show a part of the band in all charts; null for the whole. */
  zoom(range) {
    const [first, last] = this.whole();
    if (range) range = [Math.max(first, range[0]), Math.min(last, range[1])];
    this.range = range && range[1] > range[0] && (range[0] > first || range[1] < last) ? range : null;
    element("whole").hidden = !this.range;
    for (const { plot } of this.charts) if (plot) this.setRange(plot);
    this.charts.filter((chart) => chart.quantity === "nyquist").forEach((chart) => drawNyquist(chart.holder, this, chart.pair));
    this.onRange(this.range);
  }

  setRange(plot) {
    const [min, max] = this.range ?? this.whole();
    plot.setScale("x", { min, max });
  }

  /** The band that is being chosen, while it is. */
  choosing(u) {
    if (u.select.width >= LEAST_WIDTH) this.onBand(this.ends(u));
  }

  ends(u) {
    return [u.select.left, u.select.left + u.select.width].map((place) => u.posToVal(place, "x"));
  }

  selected(u) {
    if (u.select.width < LEAST_WIDTH) return;
    const ends = this.ends(u);
    u.setSelect({ left: 0, width: 0 }, false);
    this.zoom(ends);
  }

  /** Wheel, Shift and drag, double click. */
  listen(u) {
    const over = u.over;
    over.addEventListener("dblclick", () => this.zoom(null));
    over.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return; // the page scrolls; two fingers on a pad come with Ctrl
      event.preventDefault();
      const factor = event.deltaY > 0 ? 1.25 : 0.8;
      const [begin, end] = this.range ?? this.whole();
      const at = u.posToVal(event.clientX - over.getBoundingClientRect().left, "x");
      this.zoom([at - (at - begin) * factor, at + (end - at) * factor]);
    }, { passive: false });
    over.addEventListener("mousedown", (event) => {
      if (event.shiftKey && this.range) this.pan(u, event);
    }, true);
  }

  pan(u, event) {
    event.stopImmediatePropagation();
    const [begin, end] = this.range;
    const [first, last] = this.whole();
    const width = u.over.clientWidth;
    const move = (now) => {
      const wanted = ((event.clientX - now.clientX) / width) * (end - begin);
      const step = Math.min(last - end, Math.max(first - begin, wanted));
      this.zoom([begin + step, end + step]);
    };
    const stop = () => window.removeEventListener("mousemove", move);
    window.addEventListener("mousemove", move);
    window.addEventListener("mouseup", stop, { once: true });
  }

  /** By keys: + and - zoom in the middle, arrows pan, 0 shows the whole band. */
  key(event) {
    const step = { "+": [0.8, 0], "-": [1.25, 0], ArrowLeft: [1, -0.1], ArrowRight: [1, 0.1] }[event.key];
    if (!step && event.key !== "0") return;
    event.preventDefault();
    if (!step) return this.zoom(null);
    const [begin, end] = this.range ?? this.whole();
    const [first, last] = this.whole();
    const half = (step[0] * (end - begin)) / 2;
    const middle = Math.min(last - half, Math.max(first + half, (begin + end) / 2 + step[1] * (end - begin)));
    this.zoom([middle - half, middle + half]);
  }

  /** Values at the cursor, in units. */
  readouts(u) {
    const line = u.cursor.idx;
    const seen = new Set();
    for (const chart of this.charts) {
      if (!chart.plot || seen.has(chart.readout)) continue;
      seen.add(chart.readout);
      const words = line === null || line === undefined ? [] : this.words(chart, line);
      [...chart.readout.children].forEach((cell, i) => cell.replaceChildren(...(words[i] ?? [])));
    }
  }

  /** What the cells of a readout hold: each a value, then its name, of which the end may be cut. */
  words(chart, line) {
    const { model, curves } = this.store;
    const unit = model.unit.slice(model.unit.lastIndexOf("[") + 1, -1);
    const at = (array) => drawn(chart.quantity, partsOf(array, chart.pair))[line];
    const value = (name, variable, number) => {
      const shown = make("b", {}, `${number === null ? "–" : number.toPrecision(4)} ${unitOf(chart.quantity, unit)}`);
      shown.style.setProperty("--swatch", `var(${variable})`);
      return [shown, ` ${name}`];
    };
    const frequency = [make("b", {}, `${three(model.frequency[line])} Hz`)];
    if (chart.quantity === "coherence") return [frequency, [`coherence ${rowOf(model.coherence, chart.pair)[line].toPrecision(4)}`]];
    const error = [make("b", {}, `${three(rowOf(curves.now.error, chart.pair)[line])} σ`), " error"];
    const shown = CURVES.filter(({ name }) => curves[name] && !this.hidden.has(name));
    const values = shown.map(({ name, colour: variable }) => value(this.named(name), variable, at(curves[name].predicted)));
    return [frequency, error, value("measured", "--data", at(model.measured)), ...values];
  }

  resize() {
    for (const { plot, holder } of this.charts) {
      if (plot && Math.abs(plot.width - holder.clientWidth) > 1) plot.setSize({ width: holder.clientWidth, height: plot.height });
    }
    this.charts.filter((chart) => chart.quantity === "nyquist").forEach((chart) => drawNyquist(chart.holder, this, chart.pair));
  }
}

/** Errors up to two deviations are what noise does. */
function shadeNoise(u) {
  const top = u.valToPos(2, "y", true);
  const { left, width, top: upper, height } = u.bbox;
  u.ctx.save();
  u.ctx.fillStyle = colour("--shade");
  u.ctx.fillRect(left, top, width, upper + height - top);
  u.ctx.restore();
}
