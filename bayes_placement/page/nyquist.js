// The Nyquist view: imaginary over real part, both to one scale.

import { CURVES, colour, paper } from "./look.js";
import { partsOf } from "./quantities.js";

const MARGIN = 34;

export function drawNyquist(canvas, curves, pair) {
  const { model, curves: known } = curves.store;
  const { pen, width, height } = paper(canvas);
  const [begin, end] = curves.range ?? [-Infinity, Infinity];
  const isInside = (i) => model.frequency[i] >= begin && model.frequency[i] <= end;
  const measured = partsOf(model.measured, pair);
  const toScreen = scaled(measured, isInside, width, height);
  axes(pen, toScreen, width, height);
  for (const { name, colour: variable, width: thick, dash } of CURVES) {
    if (!known[name] || curves.hidden.has(name)) continue;
    pen.beginPath();
    pen.strokeStyle = colour(variable);
    pen.lineWidth = thick;
    pen.setLineDash(dash ?? []);
    let joined = false;
    forEachPoint(partsOf(known[name].predicted, pair), isInside, toScreen, (x, y) => {
      pen[joined ? "lineTo" : "moveTo"](x, y);
      joined = true;
    });
    pen.stroke();
  }
  pen.setLineDash([]);
  if (!curves.hidden.has("measured")) {
    pen.fillStyle = colour("--data");
    forEachPoint(measured, isInside, toScreen, (x, y) => pen.fillRect(x - 1.6, y - 1.6, 3.2, 3.2));
  }
}

function forEachPoint([real, imaginary], isInside, toScreen, action) {
  for (let i = 0; i < real.length; i += 1) {
    if (isInside(i) && Number.isFinite(real[i])) action(...toScreen(real[i], imaginary[i]));
  }
}

/** Map to the screen by what was measured, with the same scale along both axes. */
function scaled([real, imaginary], isInside, width, height) {
  let [left, right, low, high] = [0, 0, 0, 0];
  for (let i = 0; i < real.length; i += 1) {
    if (!isInside(i) || !Number.isFinite(real[i])) continue;
    [left, right] = [Math.min(left, real[i]), Math.max(right, real[i])];
    [low, high] = [Math.min(low, imaginary[i]), Math.max(high, imaginary[i])];
  }
  const scale = Math.min((width - 2 * MARGIN) / (right - left || 1), (height - 2 * MARGIN) / (high - low || 1));
  const [x, y] = [(left + right) / 2, (low + high) / 2];
  return (re, im) => [width / 2 + (re - x) * scale, height / 2 - (im - y) * scale];
}

function axes(pen, toScreen, width, height) {
  const [x, y] = toScreen(0, 0);
  pen.strokeStyle = colour("--line");
  pen.lineWidth = 1;
  pen.beginPath();
  pen.moveTo(0, y);
  pen.lineTo(width, y);
  pen.moveTo(x, 0);
  pen.lineTo(x, height);
  pen.stroke();
  pen.fillStyle = colour("--faint");
  pen.font = "12px system-ui";
  pen.fillText("real", width - 28, y - 6);
  pen.fillText("imaginary", x + 6, 12);
}
