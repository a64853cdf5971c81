// The page: what the server tells goes to its parts, and what a person does goes to the server.

import { Curves } from "./curves.js";
import { Learn } from "./learn.js";
import { element, make, percent, three } from "./look.js";
import { Matrix } from "./matrix.js";
import { Modes } from "./modes.js";
import { Parameters } from "./parameters.js";
import { linked } from "./socket.js";
import { Steps } from "./steps.js";
import { StructurePanel } from "./structure.js";

const MOST_SHOWN = 4;
const LEAST_SHARE = 0.03; // of a task, from which on its pace is known
const STILL = 400; // [ms] after which a band that is shown is looked at
const SAVED = ["model", "case", "report"];
const BY_ITSELF = ["port", "modes", "band"]; // what is asked for without a press

const store = { model: null, curves: {}, shown: [0], state: null, reach: null, ledger: null, faults: null, palette: [], x: null };
const send = (message) => {
  if (!BY_ITSELF.includes(message.do)) element("trouble").hidden = true; // what was told is answered
  link.send(message);
};

const curves = new Curves(store, (range) => {
  matrix.range = range;
  matrix.draw();
  chooseBand(range);
  clearTimeout(store.asking);
  if (range && store.reach) store.asking = setTimeout(() => send({ do: "band", low: range[0], high: range[1] }), STILL);
}, chooseBand);
const matrix = new Matrix(store, toggle, (range) => curves.zoom(range));
const learn = new Learn(store, () => send({ do: "reach" }));
const steps = new Steps(store, (state) => send({ do: "go", state }), (state) => send({ do: "compare", state }));
const parameters = new Parameters(store, {
  preview: (values) => link.preview({ do: "move", values }),
  set: (values) => send({ do: "set", values }),
  remove: (effect) => send({ do: "remove", effect }),
});
const structure = new StructurePanel(store, {
  add: (at) => add(at),
  drag: (effect, at) => link.preview({ do: "drag", effect, at }),
  put: (effect, at) => send({ do: "put", effect, at }),
  port: (kind) => send({ do: "port", acts_on: kind }),
});
const modes = new Modes(store, structure, () => send({ do: "modes" }));

/** Bound reach within a band at once, also while it is being chosen. */
function chooseBand(band) {
  store.band = band;
  if (band && store.reach?.is_bounded) link.preview({ do: "bound", low: band[0], high: band[1] });
  if (!band) store.bound = null;
  if (store.reach) structure.reached();
}

/** Show one pair, or with Ctrl or Shift one more. */
function toggle(pair, isFurther) {
  const isShown = store.shown.includes(pair);
  if (!isFurther) store.shown = [pair];
  else if (isShown && store.shown.length > 1) store.shown = store.shown.filter((each) => each !== pair);
  else if (!isShown) store.shown = [...store.shown, pair].slice(-MOST_SHOWN);
  curves.build();
  matrix.draw();
}

function chosen() {
  return store.palette.find((kind) => kind.kind === element("kind").value);
}

function add(at) {
  const kind = chosen();
  if (!kind) return;
  const variant = element("variant");
  const number = variant.hidden || variant.value === "" ? null : Number(variant.value);
  const place = kind.is_placed ? at ?? structure.peak() : null;
  send({ do: "add", kind: kind.kind, number: number ?? (place ? null : 1), at: place });
}

function choose() {
  const kind = chosen();
  if (!kind) return;
  const variant = element("variant");
  const isAsked = !kind.is_placed && kind.settings.length > 1;
  variant.hidden = !isAsked;
  variant.replaceChildren(...kind.settings.map((words, i) => make("option", { value: i + 1 }, words || `variant ${i + 1}`)));
  element("hint").textContent = kind.is_placed
    ? "Click on the structure to drop it, or Add it at the peak; drag it to move it."
    : "It has no place: press Add.";
}

/** What the server tells, by its word. */
const HEARD = {
  model(header) {
    const isNew = store.model?.name !== header.name;
    Object.assign(store, { model: header, x: null });
    if (isNew) store.shown = [0];
    document.title = `${header.name} · explore`;
    element("name").textContent = header.name;
    element("words").textContent = element("words").title = header.words;
    for (const what of SAVED) element(`save-${what}`).hidden = !header.saves.includes(what);
    structure.begin();
    matrix.begin();
  },
  curves(header) {
    const isFirst = !store.curves[header.name];
    store.curves[header.name] = header;
    if (!store.task) rest();
    if (header.name === "now") {
      element("chi2").textContent = three(header.chi2);
      store.isPreview = !header.is_state;
      label(header.task);
      if (header.task) {
        steps.seen(header.chi2, header.title);
        parameters.preview(header.values);
      }
      if (isFirst) begin(header);
      matrix.draw();
      structure.draw();
    } else if (isFirst || header.title) curves.legend();
    curves.refresh();
    if (header.serial) requestAnimationFrame(() => (document.body.dataset.drawn = header.serial));
  },
  state(header) {
    store.state = header;
    label("");
    element("undo").disabled = !header.can_undo;
    element("redo").disabled = !header.can_redo;
    parameters.show();
    steps.show();
    structure.draw();
    modes.stale();
  },
  palette(header) {
    store.palette = header.kinds;
    const before = element("kind").value;
    element("kind").replaceChildren(...header.kinds.map(({ kind }) => make("option", { value: kind }, kind.replaceAll("_", " "))));
    if (before) element("kind").value = before;
    choose();
  },
  reach(header) {
    Object.assign(store, { reach: header, beside: null, bound: null, reachOfBand: null });
    chooseBand(store.band);
    if (store.band) send({ do: "band", low: store.band[0], high: store.band[1] });
    learn.show();
  },
  beside(header) {
    store.beside = header.acts_on ? header : null;
    structure.reached();
  },
  bound(header) {
    if (store.band) store.bound = header;
    structure.reached();
    requestAnimationFrame(() => (document.body.dataset.bounded = header.serial));
  },
  band(header) {
    store.reachOfBand = header;
    structure.reached();
  },
  ledger(header) {
    store.ledger = header;
    learn.show();
  },
  faults(header) {
    store.faults = header;
    learn.show();
  },
  background: (header) => learn.background(header),
  task(header) {
    const isBusy = header.task !== "";
    if (header.task !== store.task) {
      store.begun = performance.now();
      store.isStopping = false;
    }
    store.task = header.task;
    if (isBusy) store.inLine = "";
    else steps.ended();
    element("stop").hidden = !isBusy;
    for (const name of ["fit", "search", "save-report"]) element(name).disabled = isBusy;
    if (!isBusy) rest();
    else if (!store.isStopping) tell(`${header.task} ${header.share ? percent(header.share) + timeLeft(header.share) : "…"}`, header.share);
  },
  busy: (header) => tell(`${header.words} ${inLine()}`, 0),
  modes: (header) => modes.hear(header),
  next(header) {
    store.next = header;
    learn.show();
  },
  error(header) {
    element("trouble").textContent = header.words;
    element("trouble").hidden = false;
    store.inLine = "";
    rest();
  },
  saved(header) {
    if (!store.task) rest();
    element("saved").textContent = header.words;
    element("saved").hidden = false;
    setTimeout(() => (element("saved").hidden = true), 9000);
  },
};

/** Time that a task still takes at the pace so far, in words; nothing where that is not known. */
function timeLeft(share) {
  const seconds = ((performance.now() - store.begun) / 1000) * (1 / share - 1);
  if (share < LEAST_SHARE || !Number.isFinite(seconds)) return "";
  return seconds < 90 ? `, about ${Math.max(1, Math.round(seconds))} s left` : `, about ${Math.round(seconds / 60)} min left`;
}

/** Say what the number is not: by hand or by a fit it is no verdict. */
function label(task) {
  const isFound = store.state?.steps[store.state.current].title.startsWith("search");
  const words = task ? `${task} on its way` : store.isPreview ? "preview, not a verdict" : "not a verdict";
  element("preview").textContent = isFound && !store.isPreview && !task ? "as the search found it" : words;
}

function begin(header) {
  const worst = header.chi2_of_pairs.reduce((best, chi2, i, all) => (chi2 > all[best] || !Number.isFinite(all[best]) ? i : best), 0);
  store.shown = [worst];
  curves.begin();
  learn.show();
}

function tell(words, share) {
  element("progress").hidden = words === "";
  element("progress").querySelector("span").textContent = words;
  element("progress").querySelector("i").style.setProperty("--share", percent(share ?? 0).replace(" ", ""));
}

const inLine = () => (store.inLine ? `${store.inLine} waits for what was asked before …` : "");

/** Nothing is on its way but what waits for its turn. */
const rest = () => tell(inLine(), 0);

for (const name of ["undo", "redo", "reset"]) element(name).onclick = () => send({ do: name });
for (const name of ["fit", "search"]) {
  element(name).onclick = () => {
    send({ do: name });
    store.inLine = name;
    rest();
  };
}
element("stop").onclick = () => {
  send({ do: "stop" });
  store.isStopping = true;
  tell("stopping …", 0);
};
for (const what of SAVED) element(`save-${what}`).onclick = () => send({ do: "save", what });
element("kind").onchange = choose;
element("add").onclick = () => add(null);
element("trouble").onclick = () => (element("trouble").hidden = true);

document.addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.target.matches("input[type=text]")) return;
  const word = { z: event.shiftKey ? "redo" : "undo", y: "redo" }[event.key.toLowerCase()];
  if (!word) return;
  event.preventDefault();
  send({ do: word });
});

// What holds this page gives it the height that it needs.
if (location.protocol === "about:") {
  document.body.classList.add("held");
  new ResizeObserver(() => {
    if (window.frameElement) window.frameElement.style.height = `${document.body.scrollHeight + 2}px`;
  }).observe(document.body);
}

const dark = matchMedia("(prefers-color-scheme: dark)");
function theme(isDark) {
  document.documentElement.toggleAttribute("data-dark", isDark);
  if (!store.curves.now) return;
  curves.begin();
  matrix.draw();
  structure.draw();
  steps.draw();
  learn.show();
}
dark.onchange = () => theme(dark.matches);
element("theme").onclick = () => theme(!document.documentElement.hasAttribute("data-dark"));
theme(dark.matches);

const link = linked(
  (header) => (store.model || header.is === "model") && HEARD[header.is]?.(header), // others may stream already
  (isThere) => {
    store.inLine = "";
    element("trouble").hidden = isThere;
    if (!isThere) element("trouble").textContent = "The program behind this page does not answer. It goes on once it is back: run the command again.";
  },
);
