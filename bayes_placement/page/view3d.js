// From a structure in space to the screen: seen along a direction, turned by dragging.

const THIN = 0.15; // share of the longest side up to which a structure is seen along its thinnest

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

export class View {
  constructor(structure) {
    this.low = structure.low;
    this.high = structure.high;
    this.middle = this.low.map((low, i) => (low + this.high[i]) / 2);
    this.size = this.low.map((low, i) => this.high[i] - low);
    this.isLine = structure.on_a_line;
    const longest = Math.max(...this.size) || 1;
    const thin = [0, 1, 2].filter((i) => this.size[i] <= THIN * longest);
    this.isFlat = this.isLine || thin.length > 0;
    // Seen along the thinnest axis; a body in space obliquely.
    this.yaw = this.isFlat ? 0 : -0.6;
    this.pitch = this.isFlat ? 0 : 0.45;
    const across = thin.length ? thin[thin.length - 1] : 1;
    this.axes = { 0: [1, 2, 0], 1: [0, 2, 1], 2: [0, 1, 2] }[across];
  }

  /** Right, up and towards the reader, in coordinates of the structure. */
  frame() {
    const [right, up, near] = this.axes.map((axis) => [0, 1, 2].map((i) => Number(i === axis)));
    const [c, s, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const mix = (a, x, b, y) => a.map((value, i) => x * value + y * b[i]);
    const turned = [mix(right, c, near, s), mix(near, c, right, -s)];
    return [turned[0], mix(up, cp, turned[1], sp), mix(turned[1], cp, up, -sp)];
  }

  fit(width, height, margin) {
    const [right, up] = this.frame();
    const corners = [];
    for (let k = 0; k < 8; k += 1) corners.push([0, 1, 2].map((i) => ((k >> i) & 1 ? this.high[i] : this.low[i])));
    const extent = (along) => {
      const all = corners.map((corner) => dot(corner, along));
      return Math.max(...all) - Math.min(...all);
    };
    const across = this.isLine ? 0 : extent(up);
    this.scale = Math.min((width - 2 * margin) / (extent(right) || 1e-9), across ? (height - 2 * margin) / across : Infinity);
    this.centre = [width / 2, this.isLine ? 0.6 * height : height / 2]; // a line has a profile above
  }

  toScreen(point) {
    const [right, up] = this.frame();
    const from = point.map((value, i) => value - this.middle[i]);
    return [this.centre[0] + this.scale * dot(from, right), this.centre[1] - this.scale * dot(from, up)];
  }

  /** Look at a flat structure obliquely, so that it is seen to move; or straight again. */
  tilt(isOblique) {
    if (!this.isFlat || this.isLine) return;
    this.yaw = isOblique ? -0.5 : 0;
    this.pitch = isOblique ? -0.9 : 0;
  }

  turn(dx, dy) {
    this.yaw += dx / 120;
    this.pitch = Math.max(-1.5, Math.min(1.5, this.pitch + dy / 120));
  }

  /** Point of the structure that is nearest to a place on the screen. */
  nearest([x, y], structure) {
    let best = { distance: Infinity, point: this.middle };
    const consider = (point, [px, py]) => {
      const distance = Math.hypot(px - x, py - y);
      if (distance < best.distance) best = { distance, point };
    };
    const screen = structure.points.map((point) => this.toScreen(point));
    if (!structure.lines.length) structure.points.forEach((point, i) => consider(point, screen[i]));
    for (const [a, b] of structure.lines) {
      const [ax, ay] = screen[a];
      const [dx, dy] = [screen[b][0] - ax, screen[b][1] - ay];
      const share = Math.max(0, Math.min(1, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
      const point = structure.points[a].map((value, i) => value + share * (structure.points[b][i] - value));
      consider(point, [ax + share * dx, ay + share * dy]);
    }
    return this.isSurface(structure) ? this.onSurface([x, y]) ?? best.point : best.point;
  }

  /** Whether it is a flat thing seen from above, where every place within is meant. */
  isSurface(structure) {
    const extended = this.size.filter((side) => side > 1e-9).length;
    return !this.isLine && extended === 2 && this.yaw === 0 && this.pitch === 0 && structure.lines.length > 60;
  }

  onSurface([x, y]) {
    const [right, up] = this.frame();
    const [a, b] = [(x - this.centre[0]) / this.scale, (this.centre[1] - y) / this.scale];
    const point = this.middle.map((value, i) => value + a * right[i] + b * up[i]);
    return point.map((value, i) => Math.max(this.low[i], Math.min(this.high[i], value)));
  }
}
