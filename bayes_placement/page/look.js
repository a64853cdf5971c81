// Colours of the page, numbers for people, and small helpers of all modules.

export const CURVES = [
  { name: "as drawn", colour: "--drawn", width: 1.2, dash: [5, 4] },
  { name: "fitted as given", colour: "--fitted", width: 1.4 },
  { name: "completed", colour: "--completed", width: 1.6 },
  { name: "compared", colour: "--compared", width: 1.6, dash: [9, 3] },
  { name: "now", colour: "--now", width: 2.2 },
];

export const element = (name) => document.getElementById(name);

export function colour(variable) {
  return getComputedStyle(document.documentElement).getPropertyValue(variable).trim();
}

/** Make an element with attributes and children; text is never read as markup. */
export function make(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "class") made.className = value;
    else if (value !== false && value !== null) made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children);
  return made;
}

/** Replace what an element holds; a button that had the focus has it again, by its place. */
export function renew(holder, ...children) {
  const at = [...holder.querySelectorAll("button")].indexOf(document.activeElement);
  holder.replaceChildren(...children);
  if (at >= 0) holder.querySelectorAll("button")[at]?.focus({ preventScroll: true });
}

/** Three digits, as the package writes a reduced chi-square. */
export function three(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size >= 100 && size < 1e6) return value.toFixed(0);
  return size === 0 || (size >= 1e-3 && size < 1e6)
    ? value.toPrecision(3)
    : value.toExponential(2);
}

export const number = (value) => String(Number(Number(value).toPrecision(6)));

export const percent = (share) => `${Math.round(100 * share)} %`;

/** Colour of a reduced chi-square: calm at 1, alarming from a thousand on. */
export function heat(chi2) {
  if (chi2 === null || !Number.isFinite(chi2)) return colour("--line");
  const share = Math.min(1, Math.max(0, Math.log10(Math.max(chi2, 1e-9)) / 3));
  const hue = 168 - 156 * share ** 0.5;
  return `hsl(${hue} ${45 + 35 * share}% ${document.documentElement.hasAttribute("data-dark") ? 32 + 16 * share : 78 - 26 * share}%)`;
}

/** Ready a canvas of the size that its style gives it, in pixels of the screen. */
export function paper(canvas) {
  const { width, height } = canvas.getBoundingClientRect();
  const ratio = window.devicePixelRatio || 1;
  const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  return { pen, width, height };
}

/** Do something at most once a frame of the screen. */
export function oncePerFrame(action) {
  let waiting = false;
  return () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      action();
    });
  };
}
