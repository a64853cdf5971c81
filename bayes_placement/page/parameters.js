// A slider and a number for each unknown, with its prior drawn behind; those of effects come first.

import { element, make, number } from "./look.js";

const STEPS = 1000;
const REST = 800; // [ms] after the last press of a key
const FOLDED = ["sensor", "actuator", "noise"];
const TITLES = { modes: "Structure", damping: "Damping", structure: "Structure", noise: "Noise", sensor: "Sensor", actuator: "Actuator" };

export class Parameters {
  constructor(store, act) {
    this.store = store;
    this.act = act; // { preview(values), set(values), remove(effect) }
    this.rows = new Map();
    this.key = "";
  }

  /** Show the state; rows stay where they are the same, so that none loses its focus. */
  show() {
    const { sliders } = this.store.state;
    const key = sliders.map((slider) => slider.name).join("\n");
    if (key !== this.key) this.build(sliders);
    this.key = key;
    for (const slider of sliders) this.rows.get(slider.name).take(slider.value);
  }

  /** Numbers of a preview that is no state: of a fit on its way. */
  preview(values) {
    for (const [name, value] of Object.entries(values)) this.rows.get(name)?.take(value);
  }

  build(sliders) {
    this.rows = new Map();
    const effects = new Set(this.store.state.effects.map((effect) => effect.name));
    const groups = new Map();
    for (const slider of sliders) {
      const isEffect = effects.has(slider.owner);
      const title = isEffect ? slider.owner : `${TITLES[slider.kind] ?? slider.kind} ${slider.owner}`.trim();
      const group = groups.get(title) ?? { title, isEffect, kind: slider.kind, sliders: [] };
      group.sliders.push(slider);
      groups.set(title, group);
    }
    for (const name of effects) if (!groups.has(name)) groups.set(name, { title: name, isEffect: true, kind: "effects", sliders: [] });
    const ordered = [...groups.values()].sort((a, b) => Number(b.isEffect) - Number(a.isEffect));
    const isFolded = (group) => FOLDED.includes(group.kind) && !group.isEffect;
    const folded = ordered.filter(isFolded);
    const open = ordered.filter((group) => !isFolded(group)).map((group) => this.group(group));
    const rest = make("details", {}, make("summary", {}, "Sensors, actuators and noise"), ...folded.map((group) => this.group(group)));
    element("parameters").replaceChildren(...open, ...(folded.length ? [rest] : []));
  }

  group({ title, isEffect, sliders }) {
    const remove = make("button", { onclick: () => this.act.remove(title), "aria-label": `Remove ${title}` }, "Remove");
    const legend = make("legend", {}, make("span", {}, title), ...(isEffect ? [remove] : []));
    const rows = sliders.map((slider) => {
      const row = new Row(slider, this.act);
      this.rows.set(slider.name, row);
      return row.box;
    });
    return make("fieldset", { class: isEffect ? "effect" : "" }, legend, ...rows);
  }
}

class Row {
  constructor(slider, act) {
    this.slider = slider;
    this.act = act;
    const label = `${slider.owner} ${slider.label}`.trim();
    this.range = make("input", { type: "range", min: 0, max: slider.is_whole ? slider.high - slider.low : STEPS, step: 1, "aria-label": label });
    this.number = make("input", { type: "text", inputmode: "decimal", "aria-label": `${label} in ${slider.unit || "1"}` });
    this.range.addEventListener("input", () => this.moved(false));
    this.range.addEventListener("change", () => (this.isByKey ? this.rest() : this.moved(true)));
    this.range.addEventListener("pointerdown", () => (this.isByKey = false));
    // Where it was dragged and brought back it has not changed, for the browser.
    this.range.addEventListener("pointerup", () => setTimeout(() => this.isHeld && !this.isByKey && this.moved(true)));
    this.range.addEventListener("keydown", (event) => {
      this.isByKey = true;
      if (event.ctrlKey || event.metaKey) this.end();
    });
    this.range.addEventListener("blur", () => this.end());
    this.number.addEventListener("input", () => (this.isTyped = true)); // not to be replaced meanwhile
    this.number.addEventListener("change", () => this.typed());
    const track = make("div", { class: "track" }, density(slider.density), this.range);
    const box = make("div", { class: "number" }, this.number, make("span", {}, slider.unit));
    this.box = make("div", { class: "slider", title: `${slider.name}\nprior ${slider.prior}` }, make("label", {}, slider.label), box, track);
  }

  value() {
    const { low, high, origin, is_logarithmic: isLogarithmic, is_whole: isWhole } = this.slider;
    const share = this.range.value / this.range.max;
    if (isWhole) return low + Number(this.range.value);
    return isLogarithmic ? origin + (low - origin) * ((high - origin) / (low - origin)) ** share : low + share * (high - low);
  }

  share(value) {
    const { low, high, origin, is_logarithmic: isLogarithmic } = this.slider;
    return isLogarithmic ? Math.log((value - origin) / (low - origin)) / Math.log((high - origin) / (low - origin)) : (value - low) / (high - low || 1);
  }

  take(value) {
    this.known = value;
    if (this.isHeld) return;
    this.range.value = Math.round(this.share(value) * this.range.max);
    if (!this.isTyped) this.number.value = number(value * this.slider.factor);
  }

  moved(isEnd) {
    const value = this.value();
    this.isHeld = !isEnd;
    this.number.value = number(value * this.slider.factor);
    this.act[isEnd ? "set" : "preview"]({ [this.slider.name]: value });
  }

  /** Presses of a key that follow each other are one step, as one drag is. */
  rest() {
    clearTimeout(this.resting);
    this.resting = setTimeout(() => this.end(), REST);
  }

  end() {
    if (this.resting === undefined) return;
    clearTimeout(this.resting);
    this.resting = undefined;
    this.moved(true);
  }

  typed() {
    this.isTyped = false;
    const text = this.number.value.trim().replace(",", ".");
    const value = Number(text) / this.slider.factor;
    if (text && Number.isFinite(value)) this.act.set({ [this.slider.name]: value });
    else this.take(this.known);
  }
}

/** The prior along the range of its slider. */
function density(heights) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 1 1");
  svg.setAttribute("preserveAspectRatio", "none");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS(svg.namespaceURI, "path");
  const at = (height, i) => `${i / (heights.length - 1)} ${1 - 0.86 * height}`;
  if (heights.length > 1) path.setAttribute("d", `M0 1L${heights.map(at).join("L")}L1 1Z`);
  svg.append(path);
  return svg;
}
