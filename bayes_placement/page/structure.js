// The structure: sensors, tolerances, reach along it, effects that are dropped and dragged, modes.

import { kindsOf } from "./band.js";
import { colour, element, heat, make, oncePerFrame, paper, percent, renew } from "./look.js";
import { View } from "./view3d.js";

const MARGIN = 34;
const NEAR = 14; // pixels within which an effect is taken hold of
const TRIAD = 18; // pixels that an axis is long
const PROFILE = 0.72; // share of the height above a line that a reach of 100 % takes
const HELD = "What any law could remove of the misfit here, all other numbers held as they are; a fit of these may remove more";
const BOUND = "What any law could remove of the misfit of this band, all other numbers refitted to it to first order";
const NAMES = { displacement: "force", rotation: "moment", cut: "cut", relative: "strut" };

export class StructurePanel {
  constructor(store, act) {
    this.store = store;
    this.act = act; // { add(at), drag(effect, at), put(effect, at), port(kind) }
    this.canvas = element("structure");
    this.kind = null;
    this.held = null;
    this.mode = this.before = null;
    this.draw = oncePerFrame(() => this.paint());
    new ResizeObserver(this.draw).observe(this.canvas);
    this.canvas.addEventListener("pointerdown", (event) => this.press(event));
    this.canvas.addEventListener("pointermove", (event) => this.move(event));
    this.canvas.addEventListener("pointerup", (event) => this.release(event));
    this.canvas.addEventListener("pointercancel", () => (this.held = null));
  }

  begin() {
    this.view = new View(this.store.model.structure);
    this.paint(); // where things are on the screen is known from then on
  }

  /** Kinds of ports, as reach knows them. */
  reached() {
    const kinds = kindsOf(this.store);
    this.best = kinds.find((kind) => kind.acts_on === this.kind) ?? kinds[0];
    this.kind = this.best?.acts_on ?? null;
    if (this.kind && this.kind !== this.told) this.act.port((this.told = this.kind));
    const [means, words] = this.store.beside ? [HELD, `${nameOf(this.store.beside)}: preview, any law, all else held`] : [BOUND, "upper bound: any law, all else refitted"];
    const isByAny = kinds.some((kind) => kind.any_law !== undefined);
    renew(
      element("kinds"),
      ...kinds.map((kind) => {
        const press = () => {
          this.kind = kind.acts_on;
          this.reached();
        };
        const label = `${nameOf(kind)} ${percent(kind.any_law ?? kind.few_numbers)}`;
        const title = kind.any_law !== undefined ? means : `${kind.law_in_words}: removes ${percent(kind.few_numbers)} of the misfit${kind.chance}`;
        return make("button", { "aria-pressed": String(kind.acts_on === this.kind), title, onclick: press }, label);
      }),
    );
    const byAny = element("by-any");
    byAny.textContent = isByAny ? words : "";
    byAny.title = isByAny ? means : "";
    this.draw();
  }

  /** Where the best law of the present kind sits. */
  peak() {
    const place = this.best?.best.place_m[0];
    return place ? [0, 1, 2].map((i) => place[i] ?? 0) : null;
  }

  paint() {
    if (!this.view) return;
    const { pen, width, height } = paper(this.canvas);
    this.view.fit(width, height, MARGIN);
    this.outline(pen);
    const reach = this.best;
    if (reach && this.view.isLine && reach.best.place_m.length === 1) this.profile(pen, reach);
    else if (reach) this.spots(pen, reach);
    this.transducers(pen);
    this.effects(pen);
    this.scaleBar(pen, width, height);
    if (!this.view.isLine) this.triad(pen, TRIAD + 4, TRIAD + 12);
  }

  outline(pen) {
    const { points, lines } = this.store.model.structure;
    const onScreen = (mode) => this.displaced(points, mode).map((point) => this.view.toScreen(point));
    const moved = onScreen(this.mode);
    if (this.before && lines.length) this.lines(pen, onScreen(this.before), colour("--drawn"), 2);
    pen.globalAlpha = lines.length > 300 && !this.mode ? 0.55 : 1;
    this.lines(pen, moved, colour(this.mode ? "--now" : "--drawn"), this.view.isLine ? 5 : 1);
    pen.globalAlpha = 1;
    if (!lines.length) {
      pen.fillStyle = colour("--drawn");
      moved.forEach(([x, y]) => pen.fillRect(x - 1.5, y - 1.5, 3, 3));
    }
  }

  lines(pen, moved, stroke, width) {
    pen.strokeStyle = stroke;
    pen.lineWidth = width;
    pen.beginPath();
    for (const [a, b] of this.store.model.structure.lines) {
      pen.moveTo(...moved[a]);
      pen.lineTo(...moved[b]);
    }
    pen.stroke();
  }

  /** Points moved by a mode shape; on a line upright, also where it moves along. */
  displaced(points, mode) {
    if (!mode) return points;
    const largest = Math.max(...this.view.size);
    const size = (this.view.isLine ? 0.09 : 0.08) * largest * Math.sin(performance.now() / 260);
    this.draw();
    return points.map((point, i) => {
      const step = mode[i];
      if (!this.view.isLine) return point.map((value, axis) => value + size * step[axis]);
      const along = step.reduce((sum, value) => sum + value, 0);
      return [point[0], point[1] + size * along, point[2]];
    });
  }

  profile(pen, reach) {
    const base = this.view.centre[1] - 9;
    const room = PROFILE * base;
    const sides = [["any_law", 0.22], ["few_numbers", 0.75]];
    for (const [word, alpha] of sides) {
      const curve = reach.curve.filter((place) => place[word] !== null).sort((a, b) => a.place_m[0][0] - b.place_m[0][0]);
      if (!curve.length) continue;
      pen.fillStyle = colour("--fitted");
      pen.globalAlpha = alpha;
      pen.beginPath();
      const at = (place) => this.view.toScreen([place.place_m[0][0], 0, 0])[0];
      pen.moveTo(at(curve[0]), base);
      curve.forEach((place) => pen.lineTo(at(place), base - room * place[word]));
      pen.lineTo(at(curve[curve.length - 1]), base);
      pen.fill();
    }
    pen.globalAlpha = 1;
    const [x] = this.view.toScreen(this.peak());
    pen.fillStyle = colour("--fitted");
    pen.font = "12px system-ui";
    pen.textAlign = "center";
    if (reach.any_law !== 0) pen.fillText(`★ ${inWords(reach)} here`, Math.max(44, Math.min(this.canvas.clientWidth - 44, x)), base - room - 8);
    pen.textAlign = "start";
  }

  spots(pen, reach) {
    for (const place of reach.curve) {
      const [x, y] = this.view.toScreen([0, 1, 2].map((i) => place.place_m[0][i] ?? 0));
      const share = place.few_numbers ?? place.any_law ?? 0;
      pen.fillStyle = heat(10 ** (3 * share));
      pen.globalAlpha = 0.25 + 0.65 * share;
      pen.beginPath();
      pen.arc(x, y, 4 + 7 * share, 0, 7);
      pen.fill();
    }
    pen.globalAlpha = 1;
    const peak = this.peak();
    if (!peak) return;
    const [x, y] = this.view.toScreen(peak);
    pen.strokeStyle = colour("--fitted");
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(x, y, 13, 0, 7);
    pen.stroke();
  }

  transducers(pen) {
    const inferred = this.inferred();
    pen.font = "12px system-ui";
    const names = new Map();
    for (const transducer of this.store.model.structure.transducers) {
      const isSensor = transducer.kind === "sensor";
      const [x, y] = this.view.toScreen(transducer.at);
      pen.strokeStyle = pen.fillStyle = colour(isSensor ? "--now" : "--completed");
      this.tolerance(pen, transducer.tolerance);
      this.arrows(pen, transducer, x, y);
      triangle(pen, x, y + (this.view.isLine ? (isSensor ? -9 : 9) : 0), isSensor ? 1 : -1);
      const spot = `${x.toFixed(0)} ${y.toFixed(0)}`;
      names.set(spot, [...(names.get(spot) ?? []), transducer.name]);
      const place = inferred[`${transducer.kind} ${transducer.name}`];
      if (place) {
        const [px, py] = this.view.toScreen(place);
        pen.beginPath();
        pen.arc(px, py, 3, 0, 7);
        pen.fill();
      }
    }
    this.labels(pen, names);
  }

  /** Names of transducers; those of one place stand together. */
  labels(pen, names) {
    pen.fillStyle = colour("--faint");
    for (const [spot, all] of names) {
      const [x, y] = spot.split(" ").map(Number);
      const words = all.length > 2 ? `${all[0]}, ${all[1]} +${all.length - 2}` : all.join(", ");
      const left = Math.min(x + 8, this.canvas.clientWidth - pen.measureText(words).width - 4);
      pen.fillText(words, Math.max(4, left), y + (this.view.isLine ? 26 : -6));
    }
  }

  tolerance(pen, points) {
    pen.lineWidth = this.view.isLine ? 9 : 2;
    pen.globalAlpha = 0.3;
    pen.beginPath();
    let joined = false;
    for (const point of points) {
      if (point[0] === null) joined = false;
      else {
        pen[joined ? "lineTo" : "moveTo"](...this.view.toScreen(point));
        joined = true;
      }
    }
    pen.stroke();
    pen.globalAlpha = 1;
  }

  /** Measured and driven axes, of structures in space. */
  arrows(pen, transducer, x, y) {
    if (this.view.isLine) return;
    const length = 0.09 * Math.max(...this.view.size);
    pen.lineWidth = 1.5;
    for (const direction of transducer.directions) {
      const [hx, hy] = this.view.toScreen(transducer.at.map((value, i) => value + length * direction[i]));
      pen.beginPath();
      pen.moveTo(x, y);
      pen.lineTo(hx, hy);
      pen.stroke();
    }
  }

  inferred() {
    const { now } = this.store.curves;
    if (!now) return {};
    const places = {};
    now.items.forEach(([kind, name], i) => {
      const at = Array.from(now.places.subarray(3 * i, 3 * i + 3));
      if (at.every(Number.isFinite)) places[`${kind} ${name}`] = at;
    });
    return places;
  }

  /** Effects that were added, and where they are. */
  placed() {
    const found = this.inferred();
    return (this.store.curves.now?.added ?? [])
      .map((name) => ({ name, at: found[`effect ${name}`] }))
      .filter(({ at }) => at);
  }

  effects(pen) {
    pen.font = "600 12px system-ui";
    for (const { name, at } of this.placed()) {
      const [x, y] = this.view.toScreen(at);
      pen.fillStyle = colour("--now");
      pen.strokeStyle = colour("--paper");
      pen.lineWidth = 2.5;
      pen.beginPath();
      pen.arc(x, y, this.held?.name === name ? 11 : 9, 0, 7);
      pen.fill();
      pen.stroke();
      pen.fillStyle = colour("--ink");
      const words = this.view.isLine ? `${name} ${(1e3 * at[0]).toFixed(0)} mm` : name;
      const width = pen.measureText(words).width;
      const left = Math.max(4, Math.min(x + 13, this.canvas.clientWidth - width - 4));
      const low = y + (this.view.isLine ? 46 : left < x ? 24 : 4);
      pen.strokeText(words, left, low); // in the colour of the paper: names of others lie below
      pen.fillText(words, left, low);
    }
  }

  scaleBar(pen, width, height) {
    const wanted = (width / 4) / this.view.scale;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const length = [5, 2, 1].map((step) => step * power).find((step) => step <= wanted) ?? power;
    pen.fillStyle = colour("--faint");
    pen.fillRect(10, height - 9, length * this.view.scale, 2);
    pen.font = "11px system-ui";
    pen.fillText(length < 1 ? `${Number((1e3 * length).toPrecision(3))} mm` : `${length} m`, 10, height - 14);
  }

  /** The axes of the structure, as they are seen. */
  triad(pen, x, y) {
    const [right, up] = this.view.frame();
    pen.strokeStyle = pen.fillStyle = colour("--faint");
    pen.font = "11px system-ui";
    pen.lineWidth = 1.5;
    pen.beginPath();
    right.forEach((step, axis) => {
      pen.moveTo(x, y);
      pen.lineTo(x + TRIAD * step, y - TRIAD * up[axis]);
      if (Math.hypot(step, up[axis]) > 0.3) pen.fillText("xyz"[axis], x + 1.25 * TRIAD * step - 3, y - 1.25 * TRIAD * up[axis] + 4);
    });
    pen.stroke();
  }

  position(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  press(event) {
    if (!this.view) return;
    const place = this.position(event);
    const effect = this.placed().find(({ at }) => {
      const [x, y] = this.view.toScreen(at);
      return Math.hypot(x - place[0], y - place[1]) < NEAR;
    });
    this.canvas.setPointerCapture(event.pointerId);
    this.held = { name: effect?.name ?? null, from: place, last: place, moved: false };
  }

  move(event) {
    const place = this.position(event);
    if (!this.held) {
      const isOver = this.placed().some(({ at }) => {
        const [x, y] = this.view.toScreen(at);
        return Math.hypot(x - place[0], y - place[1]) < NEAR;
      });
      this.canvas.style.cursor = isOver ? "grab" : "";
      return;
    }
    const [dx, dy] = [place[0] - this.held.last[0], place[1] - this.held.last[1]];
    this.held.moved ||= Math.hypot(place[0] - this.held.from[0], place[1] - this.held.from[1]) > 4;
    if (!this.held.moved) return;
    this.held.last = place;
    if (this.held.name) this.act.drag(this.held.name, this.at(place));
    else if (!this.view.isLine) this.view.turn(dx, dy);
    this.draw();
  }

  release(event) {
    const held = this.held;
    this.held = null;
    if (!held) return;
    const place = this.position(event);
    if (held.name && held.moved) this.act.put(held.name, this.at(place));
    else if (!held.name && !held.moved) this.act.add(this.at(place));
    this.draw();
  }

  at(place) {
    return this.view.nearest(place, this.store.model.structure);
  }

  /** Move a mode shape, and beside it the one that it was; null for none. */
  show(shape, before) {
    if (Boolean(shape) !== Boolean(this.mode)) this.view.tilt(Boolean(shape));
    this.mode = shape;
    this.before = before;
    this.draw();
  }
}

const nameOf = (kind) => NAMES[kind.acts_on] ?? kind.acts_on;

/** How much of the misfit a law removes; in a preview, what any law could. */
const inWords = (kind) => (kind.any_law === undefined ? percent(kind.few_numbers) : `any law ${percent(kind.any_law)}`);

function triangle(pen, x, y, side) {
  pen.beginPath();
  pen.moveTo(x, y + 6 * side);
  pen.lineTo(x - 5, y - 4 * side);
  pen.lineTo(x + 5, y - 4 * side);
  pen.closePath();
  pen.fill();
}
