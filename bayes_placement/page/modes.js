// Natural modes: frequencies with and without what was added, how alike the shapes are, one moves.

import { element, make, renew, three } from "./look.js";

const ALIKE = 0.9; // modal assurance criterion from which on two shapes are taken for one mode

export class Modes {
  constructor(store, structure, ask) {
    Object.assign(this, { store, structure, ask });
    this.moving = null;
    element("modes").onclick = () => this.toggle();
  }

  get isOpen() {
    return !element("mode-list").hidden;
  }

  toggle() {
    element("mode-list").hidden = this.isOpen;
    element("modes").setAttribute("aria-pressed", String(this.isOpen));
    this.move(null);
    if (!this.isOpen) return;
    if (!this.store.modes) element("mode-list").replaceChildren(make("p", { class: "hint" }, "The modes are computed …"));
    this.ask();
  }

  /** Those of another state are asked for, where the list is open. */
  stale() {
    if (this.isOpen) this.ask();
  }

  hear(header) {
    this.store.modes = header;
    this.move(this.moving);
  }

  move(number) {
    const { now, before } = this.store.modes ?? { now: { shape: [] } };
    this.moving = number !== null && now.shape[number] ? number : null;
    const twin = this.moving === null ? null : this.twin(this.moving);
    this.structure.show(
      this.moving === null ? null : now.shape[this.moving],
      twin === null ? null : aligned(before.shape[twin], now.shape[this.moving]),
    );
    if (this.store.modes) this.list();
  }

  /** Number of the most similar mode before; null where none is alike. */
  twin(number) {
    const row = this.store.modes.mac[number] ?? [];
    const best = row.indexOf(Math.max(...row));
    return best >= 0 && row[best] > 0 ? best : null;
  }

  list() {
    const { now, before, beside } = this.store.modes;
    const head = make("tr", {}, ...["", "f [Hz]", `${beside}`, "MAC"].map((words) => make("th", {}, words)));
    const rows = now.frequency.map((hertz, i) => this.row(hertz, i));
    const note = this.moving === null ? "Press a mode: it moves." : `Blue moves as the model stands, grey ${beside}.`;
    renew(element("mode-list"), make("table", {}, head, ...rows), this.matrix(), make("p", { class: "hint" }, before.frequency.length ? note : "No mode lies in the band."));
  }

  row(hertz, i) {
    const { before, mac } = this.store.modes;
    const twin = this.twin(i);
    const press = () => this.move(this.moving === i ? null : i);
    const button = make("button", { "aria-pressed": String(this.moving === i), onclick: press }, `mode ${i + 1}`);
    if (twin === null) return make("tr", {}, make("td", {}, button), make("td", {}, three(hertz)), make("td", {}, "–"), make("td", {}, "–"));
    const change = 100 * (hertz / before.frequency[twin] - 1);
    const words = `${three(before.frequency[twin])} (${change >= 0 ? "+" : "−"}${Math.abs(change).toFixed(1)} %)`;
    const likeness = mac[i][twin].toFixed(2) + (twin === i ? "" : ` with ${twin + 1}`);
    return make("tr", {}, make("td", {}, button), make("td", {}, three(hertz)), make("td", {}, words), make("td", { class: mac[i][twin] < ALIKE ? "alarm" : "" }, likeness));
  }

  /** Modal assurance criterion of each with each, as colours. */
  matrix() {
    const { mac, beside } = this.store.modes;
    const cell = (value, i, j) => {
      const made = make("td", { title: `MAC of mode ${i + 1} and mode ${j + 1} ${beside}: ${value.toFixed(3)}` });
      made.style.background = `color-mix(in srgb, var(--accent) ${Math.round(100 * value)}%, var(--line))`;
      return made;
    };
    return make("table", { class: "mac", "aria-label": `Modal assurance criterion: rows as it stands, columns ${beside}` }, ...mac.map((row, i) => make("tr", {}, ...row.map((value, j) => cell(value, i, j)))));
  }
}

/** A shape with the sign that makes it like another one. */
function aligned(shape, other) {
  const product = shape.reduce((sum, step, i) => sum + step.reduce((part, value, axis) => part + value * other[i][axis], 0), 0);
  return product < 0 ? shape.map((step) => step.map((value) => -value)) : shape;
}
