"use strict";
(() => {
  const all = (selector, within = document) => [...within.querySelectorAll(selector)];
  const sections = () => all("details.section");

  document.getElementById("fold").addEventListener("click", () => {
    for (const section of sections()) section.open = false;
  });
  document.getElementById("unfold").addEventListener("click", () => {
    for (const section of sections()) section.open = true;
  });
  // An address within the page opens the section that it leads to.
  const openTarget = () => {
    const target = location.hash && document.getElementById(location.hash.slice(1));
    const section = target && target.closest("details.section");
    if (section) section.open = true;
  };
  addEventListener("hashchange", openTarget);
  openTarget();

  const boxes = all("input.tag");
  const filter = () => {
    const chosen = boxes.filter((box) => box.checked).map((box) => box.value);
    const items = all("article.item");
    for (const item of items) {
      const tags = JSON.parse(item.dataset.tags);
      item.hidden = chosen.length > 0 && !chosen.some((tag) => tags.includes(tag));
    }
    for (const section of sections()) section.hidden = !all("article.item:not([hidden])", section).length;
    const shown = items.filter((item) => !item.hidden).length;
    document.getElementById("shown").textContent = chosen.length ? `${shown} of ${items.length} pieces` : "";
  };
  for (const box of boxes) box.addEventListener("change", filter);
  filter();

  // Pages within the page: one text for all, each with frames of its own. On paper figures stand.
  const fillPages = async () => {
    const letters = JSON.parse(document.getElementById("inner-page").textContent);
    const bytes = Uint8Array.from(atob(letters), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    const text = await new Response(stream).text();
    for (const frame of all("iframe.page")) frame.srcdoc = text.replace("@frames@", frame.dataset.frames);
  };
  if (document.getElementById("inner-page")) fillPages();

  // Structures that move: an orthographic view, turned by dragging.
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const viewers = [];

  class Viewer {
    constructor(element) {
      this.element = element;
      this.data = JSON.parse(document.getElementById(element.dataset.shapes).textContent);
      this.canvases = all("canvas", element);
      this.visible = true;
      this.mode = 0;
      this.phase = 0;
      this.centre = [0, 1, 2].map((axis) => this.middle(axis));
      this.extent = Math.max(...[0, 1, 2].map((axis) => this.range(axis)), 1e-9);
      this.start = this.goodView();
      [this.yaw, this.pitch] = this.start;
      this.fit();
      this.controls();
      this.reset();
      this.playing = !still;
      this.label();
      new IntersectionObserver((entries) => {
        this.visible = entries.some((entry) => entry.isIntersecting);
      }).observe(element);
    }
    values(axis) { return this.data.points.map((point) => point[axis]); }
    range(axis) { const values = this.values(axis); return values.reduce((a, b) => Math.max(a, b)) - values.reduce((a, b) => Math.min(a, b)); }
    middle(axis) { const values = this.values(axis); return (values.reduce((a, b) => Math.max(a, b)) + values.reduce((a, b) => Math.min(a, b))) / 2; }
    // From the front where a line moves across the view, else from above at an angle.
    goodView() {
      const flat = [0, 1, 2].filter((axis) => this.range(axis) > 1e-6 * this.extent).length;
      const along = (axis) => this.data.models.flatMap((model) => model.shapes.flat()).reduce((most, shift) => Math.max(most, Math.abs(shift[axis])), 0);
      return flat < 2 && along(1) <= along(2) ? [0, 0] : [-0.6, 0.5];
    }
    // As large as the structure fits with room to move.
    fit() {
      const places = this.data.points.map((point) => this.project(point, 1, 0, 0));
      const size = (axis) => {
        const values = places.map((place) => place[axis]);
        return values.reduce((a, b) => Math.max(a, b)) - values.reduce((a, b) => Math.min(a, b));
      };
      const [wide, high] = [size(0), size(1)];
      const height = high < 0.2 * wide ? 230 : 360;
      for (const canvas of this.canvases) canvas.height = height;
      this.scale = Math.min((0.86 * this.canvases[0].width) / Math.max(wide, 1e-9), (0.7 * height) / Math.max(high, 1e-9));
    }
    controls() {
      const select = this.element.querySelector("select.mode");
      const count = Math.max(...this.data.models.map((model) => model.frequencies.length));
      for (let number = 0; number < count; number++) select.add(new Option(String(number + 1), String(number)));
      select.addEventListener("change", () => { this.mode = Number(select.value); this.label(); this.draw(); });
      this.element.querySelector("button.play").addEventListener("click", () => {
        this.playing = !this.playing; this.label(); this.draw();
      });
      this.element.querySelector("button.reset").addEventListener("click", () => { this.reset(); this.draw(); });
      this.size = this.element.querySelector("input.size");
      this.size.addEventListener("input", () => this.draw());
      for (const canvas of this.canvases) this.turning(canvas);
    }
    turning(canvas) {
      let last = null;
      canvas.addEventListener("pointerdown", (event) => { last = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
      canvas.addEventListener("pointermove", (event) => {
        if (!last) return;
        this.turn((event.clientX - last[0]) / 150, (event.clientY - last[1]) / 150);
        last = [event.clientX, event.clientY];
      });
      canvas.addEventListener("pointerup", () => { last = null; });
      canvas.addEventListener("keydown", (event) => {
        const steps = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
        if (steps[event.key]) { event.preventDefault(); this.turn(...steps[event.key]); }
      });
    }
    turn(right, down) {
      this.yaw += right;
      this.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, this.pitch + down));
      this.draw();
    }
    reset() { [this.yaw, this.pitch] = this.start; }
    label() {
      this.element.querySelector("button.play").textContent = this.playing ? "Pause" : "Play";
      this.element.querySelector("button.play").setAttribute("aria-pressed", String(this.playing));
      all(".frequency", this.element).forEach((place, number) => {
        const frequency = this.data.models[number].frequencies[this.mode];
        place.textContent = frequency === undefined ? "has no such mode in the band" : `mode ${this.mode + 1}, ${frequency.toPrecision(4)} Hz`;
      });
    }
    project(point, scale, width, height) {
      const [x, y, z] = point.map((value, axis) => value - this.centre[axis]);
      const across = x * Math.cos(this.yaw) - y * Math.sin(this.yaw);
      const away = x * Math.sin(this.yaw) + y * Math.cos(this.yaw);
      const up = z * Math.cos(this.pitch) - away * Math.sin(this.pitch);
      return [width / 2 + scale * across, height / 2 - scale * up];
    }
    draw(phase = this.phase) {
      this.canvases.forEach((canvas, number) => this.drawModel(canvas, this.data.models[number], phase));
      this.element.dataset.view = `${this.yaw.toFixed(3)} ${this.pitch.toFixed(3)}`;
    }
    drawModel(canvas, model, phase) {
      const pen = canvas.getContext("2d");
      const { width, height } = canvas;
      const scale = this.scale;
      pen.clearRect(0, 0, width, height);
      const shape = model.shapes[this.mode];
      const size = Number(this.size.value) * this.extent * Math.cos(phase);
      const still = this.data.points.map((point) => this.project(point, scale, width, height));
      const moved = shape && this.data.points.map((point, place) =>
        this.project(point.map((value, axis) => value + size * shape[place][axis]), scale, width, height));
      this.trace(pen, still, "#c3c8cf", 1);
      if (moved) this.trace(pen, moved, "#0067a8", 2);
      pen.font = "15px sans-serif";
      const named = new Map();
      for (const mark of this.data.marks) {
        const [x, y] = this.project(mark.at, scale, width, height);
        pen.fillStyle = mark.kind === "effect" ? "#c44e00" : "#16191d";
        pen.beginPath();
        pen.arc(x, y, mark.kind === "effect" ? 6 : 4, 0, 7);
        pen.fill();
        // Names at one place stand in one line.
        const place = `${mark.kind === "effect"} ${Math.round(x / 8)} ${Math.round(y / 8)}`;
        const label = named.get(place) || { x, y, names: [], colour: pen.fillStyle, above: mark.kind === "effect" };
        label.names.push(mark.name);
        named.set(place, label);
      }
      pen.textAlign = "center";
      for (const label of named.values()) {
        pen.fillStyle = label.colour;
        pen.fillText(label.names.join(", "), label.x, label.above ? label.y - 12 : label.y + 20);
      }
    }
    trace(pen, places, colour, width) {
      pen.strokeStyle = pen.fillStyle = colour;
      pen.lineWidth = width;
      pen.beginPath();
      for (const [first, second] of this.data.lines) {
        pen.moveTo(...places[first]);
        pen.lineTo(...places[second]);
      }
      pen.stroke();
      if (!this.data.lines.length) for (const [x, y] of places) pen.fillRect(x - 1.5 * width, y - 1.5 * width, 3 * width, 3 * width);
    }
  }

  for (const element of all(".shapes")) viewers.push(new Viewer(element));
  for (const viewer of viewers) viewer.draw();
  const step = (time) => {
    for (const viewer of viewers) {
      if (viewer.playing && viewer.visible) { viewer.phase = (time / 1500) * 2 * Math.PI; viewer.draw(); }
    }
    requestAnimationFrame(step);
  };
  if (viewers.length) requestAnimationFrame(step);

  // On paper shapes stand at their largest; what the reader left folded stays out.
  addEventListener("beforeprint", () => {
    for (const viewer of viewers) { viewer.playing = false; viewer.label(); viewer.draw(0); }
  });
})();
