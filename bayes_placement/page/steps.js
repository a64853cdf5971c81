// The ledger of steps: the error as it fell, each step returned to by a click; and the script.

import { colour, element, make, oncePerFrame, paper, renew, three } from "./look.js";

export class Steps {
  constructor(store, go, compare) {
    Object.assign(this, { store, go, compare });
    this.fitting = []; // reduced chi-squares of a fit or a search on its way
    this.found = []; // rows of the models of a search
    this.canvas = make("canvas", { id: "fall", "aria-label": "Reduced chi-square, step by step" });
    this.list = make("ol");
    this.draw = oncePerFrame(() => this.paint());
    element("copy").onclick = () => navigator.clipboard?.writeText(element("script").textContent);
  }

  show() {
    const { steps, current, path, script } = this.store.state;
    if (!this.canvas.isConnected) element("steps").replaceChildren(this.canvas, this.list);
    renew(this.list, ...steps.map((step, number) => this.row(step, number, current, path)), ...this.found);
    const pane = element("script");
    pane.textContent = script;
    pane.scrollTop = pane.scrollHeight; // its last line is the newest
    this.see(this.list.querySelector(".current"));
    this.draw();
  }

  /** Scroll the list to a row, unless it is seen: rows stay under the hand. */
  see(row) {
    const top = row ? row.offsetTop - this.list.offsetTop - this.list.scrollTop : 0;
    if (row && (top < 0 || top + row.clientHeight > this.list.clientHeight)) this.list.scrollTop += top - (this.list.clientHeight - row.clientHeight) / 2;
  }

  row(step, number, current, path) {
    const button = make("button", { onclick: (event) => this[event.shiftKey ? "compare" : "go"](number), title: `${step.title}\nShift: compare with it`, "aria-current": number === current ? "step" : false },
      make("span", {}, `${number}. ${step.title}`), make("b", {}, three(step.chi2)));
    return make("li", { class: [path.includes(number) ? "path" : "", number === current ? "current" : ""].join(" ") }, button);
  }

  /** What a fit or a search has come to; models of a search have titles. */
  seen(chi2, title) {
    this.fitting.push(chi2);
    if (title) {
      this.found.push(make("li", { class: "coming" }, make("span", {}, `${title}, so far`), make("b", {}, three(chi2))));
      this.list.append(this.found.at(-1));
    }
    this.draw();
  }

  ended() {
    this.found.forEach((row) => row.remove());
    this.fitting = [];
    this.found = [];
    this.draw();
  }

  paint() {
    if (!this.store.state || !this.canvas.isConnected) return;
    const { steps, path } = this.store.state;
    const known = path.map((number) => steps[number].chi2).filter((value) => value > 0);
    const all = [...known, ...this.fitting];
    const { pen, width, height } = paper(this.canvas);
    if (!all.length) return;
    const top = Math.max(10, ...all) * 1.6;
    const bottom = Math.min(0.5, ...all);
    const y = (chi2) => 8 + (height - 22) * (1 - Math.log(chi2 / bottom) / Math.log(top / bottom));
    const x = (i) => 46 + ((width - 58) * i) / Math.max(1, all.length - 1);
    this.grid(pen, width, y, bottom, top);
    pen.strokeStyle = pen.fillStyle = colour("--now");
    pen.lineWidth = 1.8;
    pen.beginPath();
    all.forEach((chi2, i) => pen[i ? "lineTo" : "moveTo"](x(i), y(chi2)));
    pen.stroke();
    known.forEach((chi2, i) => {
      pen.beginPath();
      pen.arc(x(i), y(chi2), 3.4, 0, 7);
      pen.fill();
    });
  }

  grid(pen, width, y, bottom, top) {
    pen.font = "11px system-ui";
    pen.lineWidth = 1;
    const apart = Math.ceil(Math.log10(top / bottom) / 6); // names of more would overlap
    for (let power = Math.ceil(Math.log10(bottom)); power <= Math.log10(top); power += 1) {
      pen.strokeStyle = colour(power === 0 ? "--completed" : "--line");
      pen.beginPath();
      pen.moveTo(40, y(10 ** power));
      pen.lineTo(width, y(10 ** power));
      pen.stroke();
      pen.fillStyle = colour("--faint");
      if (power % apart === 0) pen.fillText(power > 4 ? `1e${power}` : String(10 ** power), 0, y(10 ** power) + 4);
    }
  }
}
