"use strict";
// The comparer: pictures of high dynamic range on one canvas. Data are half floats, see pictures.rs.
(() => {
  /** Values of all half floats. */
  const halves = new Float32Array(65536);
  for (let i = 0; i < 65536; i++) {
    const [sign, exponent, mantissa] = [i & 0x8000 ? -1 : 1, (i >> 10) & 31, i & 1023];
    if (exponent === 31) halves[i] = mantissa ? NaN : sign * Infinity;
    else halves[i] = sign * (exponent ? 2 ** (exponent - 15) * (1 + mantissa / 1024) : 2 ** -24 * mantissa);
  }
  const srgb = (v) => v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055;

  /** The colour map of FLIP, as claror_io::compare::magma. */
  const MAGMA = [0x000004, 0x180f3d, 0x440f76, 0x721f81, 0x9e2f7f, 0xcd4071, 0xf1605d, 0xfd9668, 0xfeca8d, 0xfcfdbf];
  const magma = Array.from({ length: 256 }, (_, i) => {
    const t = (i / 255) * (MAGMA.length - 1);
    const k = Math.min(Math.floor(t), MAGMA.length - 2);
    return [16, 8, 0].map((shift) => {
      const [a, b] = [MAGMA[k], MAGMA[k + 1]].map((c) => (c >> shift) & 255);
      return a + (t - k) * (b - a);
    });
  });

  async function inflated(text) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  /** Three planes of half floats as bits: undoes `pack`. */
  async function unpacked(text) {
    const bytes = await inflated(text);
    const size = bytes.length / 6;
    const difference = new Int32Array(size);
    return [0, 1, 2].map((channel) => {
      const plane = new Uint16Array(size);
      const start = channel * 2 * size;
      let value = 0;
      for (let i = 0; i < size; i++) {
        const word = (bytes[start + i] << 8) | bytes[start + size + i];
        difference[i] = (difference[i] + ((word >> 1) ^ -(word & 1))) & 0xffff;
        value = (value + difference[i]) & 0xffff;
        plane[i] = value;
      }
      return plane;
    });
  }

  class Comparer {
    constructor(root) {
      this.root = root;
      this.width = Number(root.dataset.width);
      this.height = Number(root.dataset.height);
      this.scale = Number(root.dataset.scale);
      this.canvas = root.querySelector("canvas");
      this.context = this.canvas.getContext("2d");
      this.pictures = new Map();
      this.flips = new Map();
      this.layers = new Map();
      this.state = { mode: "wipe", single: "A", wipe: 0.5, zoom: 1, x: 0.5, y: 0.5, stops: 0 };
      this.pointers = new Map();
      root.hidden = false;
      this.listen();
      new ResizeObserver(() => this.resize()).observe(this.canvas.parentElement);
      this.load();
    }

    get choices() {
      const [a, b] = ["A", "B"].map((c) => this.root.querySelector(`[data-choice="${c}"]`).value);
      return { A: a, B: b, R: this.script("picture", "reference") ? "reference" : b };
    }

    script(kind, name) {
      return this.root.querySelector(`script[data-${kind}="${name}"]`);
    }

    title(name) {
      const option = [...this.root.querySelectorAll("option")].find((o) => o.value === name);
      return option ? option.textContent : name;
    }

    /** Decodes what is chosen, then draws. */
    async load() {
      for (const name of new Set(Object.values(this.choices))) {
        if (!this.pictures.has(name)) this.pictures.set(name, await unpacked(this.script("picture", name).textContent));
      }
      const { A } = this.choices;
      if (this.script("flip", A) && !this.flips.has(A)) this.flips.set(A, await inflated(this.script("flip", A).textContent));
      const mode = this.root.querySelector('input[value="visible"]');
      mode.disabled = !this.flips.has(A);
      if (mode.disabled && this.state.mode === "visible") this.setMode("wipe");
      this.root.dataset.ready = "true";
      this.draw();
    }

    /** A layer as a canvas of the picture's size; kept until exposure or choice change. */
    layer(key, fill) {
      const whole = `${key} ${this.state.stops}`;
      if (!this.layers.has(whole)) {
        if (this.layers.size > 6) this.layers.delete(this.layers.keys().next().value);
        const canvas = new OffscreenCanvas(this.width, this.height);
        const image = new ImageData(this.width, this.height);
        fill(image.data);
        canvas.getContext("2d").putImageData(image, 0, 0);
        this.layers.set(whole, canvas);
      }
      return this.layers.get(whole);
    }

    picture(name) {
      return this.layer(`picture ${name}`, (out) => {
        const [r, g, b] = this.pictures.get(name);
        const factor = 2 ** this.state.stops;
        const table = Uint8ClampedArray.from(halves, (v) => 255 * srgb(Math.min(Math.max(v * factor, 0), 1)));
        for (let i = 0; i < r.length; i++) {
          out[4 * i] = table[r[i]]; out[4 * i + 1] = table[g[i]]; out[4 * i + 2] = table[b[i]]; out[4 * i + 3] = 255;
        }
      });
    }

    /** A − B in red, B − A in blue, linear light, full at the scale of the strips. */
    difference(a, b) {
      return this.layer(`difference ${a} ${b}`, (out) => {
        const [p, q] = [this.pictures.get(a), this.pictures.get(b)];
        const factor = 2 ** this.state.stops / this.scale / 3;
        for (let i = 0; i < p[0].length; i++) {
          const d = (halves[p[0][i]] + halves[p[1][i]] + halves[p[2][i]] - halves[q[0][i]] - halves[q[1][i]] - halves[q[2][i]]) * factor;
          const v = 255 * srgb(Math.min(Math.abs(d), 1));
          out[4 * i] = d > 0 ? v : 0; out[4 * i + 1] = d === d ? 0 : 255; out[4 * i + 2] = d < 0 ? v : 0; out[4 * i + 3] = 255;
        }
      });
    }

    visible(name) {
      return this.layer(`flip ${name}`, (out) => {
        this.flips.get(name).forEach((v, i) => { const c = magma[v]; out[4 * i] = c[0]; out[4 * i + 1] = c[1]; out[4 * i + 2] = c[2]; out[4 * i + 3] = 255; });
      });
    }

    /** Where the picture lies on the canvas, in device pixels. */
    get place() {
      const { width, height } = this.canvas;
      const scale = Math.min(width / this.width, height / this.height) * this.state.zoom;
      return { scale, left: width / 2 - this.state.x * this.width * scale, top: height / 2 - this.state.y * this.height * scale };
    }

    draw() {
      if (!this.root.dataset.ready) return;
      const { canvas, context, state, place } = this;
      const { A, B, R } = this.choices;
      // Fingers scroll the page unless they can move the picture.
      canvas.style.touchAction = state.zoom === 1 ? "pan-y" : "none";
      context.imageSmoothingEnabled = place.scale < 1;
      context.clearRect(0, 0, canvas.width, canvas.height);
      const paint = (layer) => context.drawImage(layer, place.left, place.top, this.width * place.scale, this.height * place.scale);
      let shown = "";
      if (state.mode === "wipe") {
        paint(this.picture(A));
        const at = this.wipeAt();
        context.save();
        context.beginPath();
        context.rect(at, 0, canvas.width - at, canvas.height);
        context.clip();
        paint(this.picture(B));
        context.restore();
        this.drawHandle(at);
        shown = `${this.title(A)} | ${this.title(B)}`;
      } else if (state.mode === "flip") {
        const name = { A, B, R }[state.single];
        paint(this.picture(name));
        shown = `${{ A: "A: ", B: "B: ", R: "" }[state.single]}${this.title(name)}`;
      } else if (state.mode === "difference") {
        paint(this.difference(A, B));
        const scale = Number((this.scale / 2 ** state.stops).toPrecision(3));
        shown = `${this.title(A)} − ${this.title(B)}, ±${scale}: red where A is brighter`;
      } else {
        paint(this.visible(A));
        shown = `FLIP of ${this.title(A)} to the reference`;
      }
      const label = this.root.querySelector(".shown");
      if (label.textContent !== shown) label.textContent = shown;
    }

    /** The wipe stands still over the picture while it is zoomed. */
    wipeAt() {
      return Math.round(this.place.left + this.state.wipe * this.width * this.place.scale);
    }

    drawHandle(at) {
      const { canvas, context } = this;
      const unit = devicePixelRatio;
      context.fillStyle = "#000";
      context.fillRect(at - 1.5 * unit, 0, 3 * unit, canvas.height);
      context.fillStyle = "#fff";
      context.fillRect(at - 0.5 * unit, 0, unit, canvas.height);
      context.beginPath();
      context.arc(at, canvas.height / 2, 11 * unit, 0, 7);
      context.fill();
      context.lineWidth = 1.5 * unit;
      context.strokeStyle = "#000";
      context.stroke();
      context.fillStyle = "#000";
      for (const side of [-1, 1]) {
        context.beginPath();
        context.moveTo(at + side * 7 * unit, canvas.height / 2);
        context.lineTo(at + side * 3 * unit, canvas.height / 2 - 4 * unit);
        context.lineTo(at + side * 3 * unit, canvas.height / 2 + 4 * unit);
        context.fill();
      }
    }

    resize() {
      const box = this.canvas.parentElement.clientWidth;
      const ratio = Math.min(this.height / this.width, 1);
      const height = Math.min(box * ratio, 0.8 * innerHeight);
      this.canvas.style.height = `${Math.round(height)}px`;
      this.canvas.width = Math.round(box * devicePixelRatio);
      this.canvas.height = Math.round(height * devicePixelRatio);
      this.draw();
    }

    setMode(mode, single) {
      this.state.mode = mode;
      if (single) this.state.single = single;
      this.root.querySelector(`input[value="${mode}"]`).checked = true;
      this.draw();
    }

    setStops(stops) {
      this.state.stops = Math.min(Math.max(stops, -8), 8);
      this.root.querySelector("[data-exposure]").value = this.state.stops;
      this.root.querySelector(".exposure output").textContent = this.state.stops.toFixed(1).replace("-", "−");
      this.draw();
    }

    /** Zooms so that what lies under a point of the canvas stays there. */
    zoom(factor, px = this.canvas.width / 2, py = this.canvas.height / 2) {
      const before = this.place;
      const [u, v] = [(px - before.left) / before.scale / this.width, (py - before.top) / before.scale / this.height];
      this.state.zoom = Math.min(Math.max(this.state.zoom * factor, 1), 64);
      const { scale } = this.place;
      this.state.x = u - (px - this.canvas.width / 2) / scale / this.width;
      this.state.y = v - (py - this.canvas.height / 2) / scale / this.height;
      this.settle();
    }

    pan(dx, dy) {
      const { scale } = this.place;
      this.state.x -= dx / scale / this.width;
      this.state.y -= dy / scale / this.height;
      this.settle();
    }

    /** Keeps the picture in sight. */
    settle() {
      const { state } = this;
      if (state.zoom === 1) state.x = state.y = 0.5;
      state.x = Math.min(Math.max(state.x, 0), 1);
      state.y = Math.min(Math.max(state.y, 0), 1);
      this.draw();
    }

    fit() {
      Object.assign(this.state, { zoom: 1, x: 0.5, y: 0.5 });
      this.draw();
    }

    choose(name) {
      this.root.querySelector('[data-choice="A"]').value = name;
      const b = this.root.querySelector('[data-choice="B"]');
      if (this.script("picture", "reference")) b.value = "reference";
      this.load();
    }

    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const step = event.shiftKey ? 0 : 0.02;
      const move = 40 * devicePixelRatio;
      const wipe = (d) => { this.state.wipe = Math.min(Math.max(this.state.wipe + d, 0), 1); this.draw(); };
      const sideways = (sign) => step && this.state.mode === "wipe" ? wipe(sign * step) : this.pan(-sign * move, 0);
      const actions = {
        1: () => this.setMode("flip", "A"), 2: () => this.setMode("flip", "B"), 3: () => this.setMode("flip", "R"),
        " ": () => this.setMode("flip", this.state.mode === "flip" && this.state.single === "A" ? "B" : "A"),
        w: () => this.setMode("wipe"), d: () => this.setMode("difference"),
        f: () => { if (this.flips.has(this.choices.A)) this.setMode("visible"); },
        ArrowLeft: () => sideways(-1), ArrowRight: () => sideways(1),
        ArrowUp: () => this.pan(0, move), ArrowDown: () => this.pan(0, -move),
        "+": () => this.zoom(1.25), "=": () => this.zoom(1.25), "-": () => this.zoom(0.8), 0: () => this.fit(),
        "[": () => this.setStops(this.state.stops - 0.25), "]": () => this.setStops(this.state.stops + 0.25),
      };
      const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
      if (action) { event.preventDefault(); action(); }
    }

    at(event) {
      const box = this.canvas.getBoundingClientRect();
      return [(event.clientX - box.left) * devicePixelRatio, (event.clientY - box.top) * devicePixelRatio];
    }

    down(event) {
      this.canvas.setPointerCapture(event.pointerId);
      const [x, y] = this.at(event);
      const reach = (event.pointerType === "touch" ? 28 : 14) * devicePixelRatio;
      const onLine = this.state.mode === "wipe" && Math.abs(x - this.wipeAt()) < reach;
      this.pointers.set(event.pointerId, { x, y, onLine });
    }

    move(event) {
      const [x, y] = this.at(event);
      this.tell(x, y);
      const before = this.pointers.get(event.pointerId);
      if (!before) return;
      const [other] = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, p]) => p);
      if (other) {
        const spread = (p) => Math.max(Math.hypot(p.x - other.x, p.y - other.y), 1);
        this.pan((x - before.x) / 2, (y - before.y) / 2);
        this.zoom(spread({ x, y }) / spread(before), (x + other.x) / 2, (y + other.y) / 2);
      } else if (before.onLine) {
        this.state.wipe = Math.min(Math.max((x - this.place.left) / this.place.scale / this.width, 0), 1);
        this.draw();
      } else {
        this.pan(x - before.x, y - before.y);
      }
      Object.assign(before, { x, y });
    }

    /** The radiance of all pictures at a point. */
    tell(px, py) {
      if (!this.root.dataset.ready) return;
      const { scale, left, top } = this.place;
      const [x, y] = [Math.floor((px - left) / scale), Math.floor((py - top) / scale)];
      if (x < 0 || y < 0 || x >= this.width || y >= this.height) return;
      const i = y * this.width + x;
      const values = (name) => this.pictures.get(name).map((plane) => halves[plane[i]].toPrecision(4)).join("  ");
      const { A, B, R } = this.choices;
      const lines = [`pixel ${x}, ${y}`, `A  ${values(A)}`, `B  ${values(B)}`];
      if (R === "reference") lines.push(`r  ${values(R)}`);
      this.root.querySelector(".pixel").textContent = lines.join("\n");
    }

    listen() {
      const { root, canvas } = this;
      for (const select of root.querySelectorAll("select")) select.addEventListener("change", () => this.load());
      for (const radio of root.querySelectorAll("input[type=radio]")) radio.addEventListener("change", () => this.setMode(radio.value));
      root.querySelector("[data-exposure]").addEventListener("input", (e) => this.setStops(Number(e.target.value)));
      const zooms = { in: () => this.zoom(1.5), out: () => this.zoom(1 / 1.5), fit: () => this.fit() };
      for (const button of root.querySelectorAll("[data-zoom]")) button.addEventListener("click", zooms[button.dataset.zoom]);
      canvas.addEventListener("keydown", (e) => this.key(e));
      canvas.addEventListener("pointerdown", (e) => this.down(e));
      canvas.addEventListener("pointermove", (e) => this.move(e));
      for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => this.pointers.delete(e.pointerId));
      // The page scrolls until the canvas has the focus.
      canvas.addEventListener("wheel", (e) => {
        if (document.activeElement !== canvas) return;
        e.preventDefault();
        this.zoom(1.0015 ** -e.deltaY, ...this.at(e));
      }, { passive: false });
    }
  }

  const comparers = new Map([...document.querySelectorAll(".comparer")].map((root) => [root.id, new Comparer(root)]));
  for (const button of document.querySelectorAll(".to-comparer")) {
    button.hidden = false;
    button.addEventListener("click", () => {
      const comparer = comparers.get(button.dataset.comparer);
      comparer.choose(button.dataset.picture);
      comparer.root.scrollIntoView({ block: "start" });
      comparer.canvas.focus({ preventScroll: true });
    });
  }
})();
