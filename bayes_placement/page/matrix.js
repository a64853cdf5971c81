// Channels as a matrix of reduced chi-squares, and bands of each as a map.

import { colour, element, heat, make, oncePerFrame, paper, three } from "./look.js";

const ROW = 13;
const MOST_ROWS = 48;

export class Matrix {
  constructor(store, toggled, zoomed) {
    Object.assign(this, { store, toggled, zoomed });
    this.canvas = element("bands");
    this.canvas.addEventListener("click", (event) => this.press(event));
    this.draw = oncePerFrame(() => this.paint());
    new ResizeObserver(this.draw).observe(element("matrix"));
  }

  begin() {
    const { pairs } = this.store.model;
    const columns = [...new Set(pairs.map(column))];
    const rows = [...new Set(pairs.map((pair) => pair.sensor))];
    const head = make("tr", {}, make("th"), ...columns.map((name) => make("th", { title: name }, name)));
    this.buttons = [];
    const body = rows.map((sensor) =>
      make("tr", {}, make("th", { title: sensor }, sensor), ...columns.map((name) => make("td", {}, this.cell(sensor, name)))),
    );
    element("matrix").replaceChildren(make("table", {}, head, ...body));
    this.canvas.style.height = `${Math.min(pairs.length, MOST_ROWS) * ROW}px`;
    this.draw();
  }

  cell(sensor, name) {
    const number = this.store.model.pairs.findIndex((pair) => pair.sensor === sensor && column(pair) === name);
    const button = make("button", { "aria-label": `${sensor} ${name}`, onclick: (event) => this.toggled(number, event.ctrlKey || event.shiftKey) });
    this.buttons[number] = button;
    return button;
  }

  paint() {
    const { now } = this.store.curves;
    if (!now || !this.buttons) return;
    this.buttons.forEach((button, pair) => {
      const chi2 = now.chi2_of_pairs[pair];
      button.textContent = three(chi2);
      button.style.background = heat(chi2);
      button.setAttribute("aria-pressed", String(this.store.shown.includes(pair)));
    });
    const { pen, width, height } = paper(this.canvas);
    const [pairs, bands] = now.chi2_of_bands.shape;
    const high = height / Math.min(pairs, MOST_ROWS);
    for (let pair = 0; pair < Math.min(pairs, MOST_ROWS); pair += 1) {
      for (let band = 0; band < bands; band += 1) {
        pen.fillStyle = heat(now.chi2_of_bands[pair * bands + band]);
        pen.fillRect((band * width) / bands, pair * high, width / bands + 0.5, high - 1);
      }
    }
    this.marks(pen, width, height);
  }

  /** The part of the band that is shown. */
  marks(pen, width, height) {
    if (!this.range) return;
    const x = this.store.model.frequency;
    const share = (hertz) => x.findIndex((line) => line >= hertz) / x.length;
    const [begin, end] = [share(this.range[0]), this.range[1] >= x[x.length - 1] ? 1 : share(this.range[1])];
    pen.strokeStyle = colour("--ink");
    pen.lineWidth = 1.5;
    pen.strokeRect(begin * width, 0.75, Math.max(3, (end - begin) * width), height - 1.5);
  }

  press(event) {
    const box = this.canvas.getBoundingClientRect();
    const { frequency } = this.store.model;
    const bands = this.store.curves.now.chi2_of_bands.shape[1];
    const rows = Math.min(this.store.model.pairs.length, MOST_ROWS);
    const within = (number, count) => Math.max(0, Math.min(count - 1, number)); // an edge belongs to none
    const band = within(Math.floor(((event.clientX - box.left) / box.width) * bands), bands);
    const line = (edge) => frequency[within(Math.round((edge * frequency.length) / bands), frequency.length)];
    const pair = within(Math.floor(((event.clientY - box.top) / box.height) * rows), rows);
    if (!this.store.shown.includes(pair)) this.toggled(pair, false);
    this.zoomed([line(band - 1), line(band + 2)]);
  }
}

function column(pair) {
  return pair.level === null ? pair.actuator : `${pair.actuator} ${pair.level} N`;
}
