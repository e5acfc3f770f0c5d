// The figures of report.html: zoomed, hovered and linked in time.  No library, nothing is fetched.
// The page is data first: columns of numbers, and figures that name them (report_figures.py).
"use strict";
(() => {
  const page = JSON.parse(document.getElementById("flight-data").textContent);
  const root = document.documentElement;
  const section = document.getElementById("flight");
  const view = { from: page.start, to: page.end }; // s, of every time axis
  let cursor = null; // s
  const figures = [];
  const L = 62, R = 14, T = 8; // margins round a pane, px; below: 20, and 16 for a label

  // -- numbers -----------------------------------------------------------------------------------

  const decoded = {};
  const TYPES = { f8: Float64Array, f4: Float32Array, i2: Int16Array };
  function column(key) {
    if (!decoded[key]) {
      const { type, data } = page.columns[key];
      const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
      decoded[key] = new TYPES[type](bytes.buffer);
    }
    return decoded[key];
  }

  // First index whose time is not before t.
  function rowAt(times, t) {
    let low = 0, high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] < t) low = middle + 1; else high = middle;
    }
    return low;
  }

  // Rows that a span of time shows: those inside and one beyond at either end.
  const rows = (times, from, to) =>
    [Math.max(rowAt(times, from) - 1, 0), Math.min(rowAt(times, to) + 1, times.length)];

  // The row that holds at t: the last one not after it.
  const held = (times, t) => {
    const k = rowAt(times, t);
    return k < times.length && times[k] === t ? k : Math.max(k - 1, 0);
  };

  const PREFIXES = [[1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];
  function prefix(unit, peak) {
    if (!(peak > 0)) return [1, unit];
    if (!/^[a-zA-Z]/.test(unit)) { // no prefix: a power of ten, where the numbers would be long
      const power = peak < 1e-3 || peak >= 1e6 ? Math.floor(Math.log10(peak)) : 0;
      return [10 ** power, power ? `1e${power}` : unit];
    }
    const found = PREFIXES.find(([s]) => peak >= 0.5 * s);
    if (found && peak < 1e6) return [found[0], found[1] + unit];
    const power = Math.floor(Math.log10(peak));
    return [10 ** power, `1e${power} ${unit}`];
  }

  // Scale, unit and offset of an axis; the offset where the span is small beside where it lies.
  function fitted(unit, low, high) {
    const size = Math.max(Math.abs(low), Math.abs(high)), span = high - low;
    if (span > 2e-3 * size) { const [scale, name] = prefix(unit, size); return [scale, name, 0]; }
    const place = 10 ** Math.floor(Math.log10(span) + 1);
    const base = Math.round((low + high) / 2 / place) * place;
    const [scale, name] = prefix(unit, span);
    return [scale, `${name} from ${short(base, 9)} ${unit}`, base];
  }

  const short = (v, digits = 4) =>
    Number.isFinite(v) ? String(Number(v.toPrecision(digits))).replace("-", "−") : "–";
  function amount(v, unit) {
    if (!unit) return short(v);
    const [scale, name] = prefix(unit, Math.abs(v));
    return `${short(v / scale)} ${name}`;
  }

  // Round values between two limits, about n of them, with labels.
  function ticks(low, high, n) {
    const raw = (high - low) / Math.max(n, 1);
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= raw * 0.999);
    const digits = Math.min(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), 12);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++)
      found.push([k * step, (k * step).toFixed(digits).replace("-", "−")]);
    return found;
  }

  // -- paths: never more than a few points for each pixel, and the extremes of each pixel kept ------

  const at = (x, y) => `${x.toFixed(1)} ${y.toFixed(1)}`;

  function linePath(t, v, X, Y, [from, to], width) {
    const out = [];
    let pen = "M";
    const put = (x, y) => { out.push(pen + at(x, y)); pen = "L"; };
    if (to - from <= 3 * width) {
      for (let k = from; k < to; k++) if (v[k] === v[k]) put(X(t[k]), Y(v[k])); else pen = "M";
      return out.join("");
    }
    for (let k = from; k < to;) {
      const pixel = Math.floor(X(t[k]));
      let low = Infinity, high = -Infinity, n = k;
      for (; n < to && Math.floor(X(t[n])) === pixel; n++) {
        if (v[n] < low) low = v[n];
        if (v[n] > high) high = v[n];
      }
      if (low <= high) {
        put(pixel, Y(v[k] === v[k] ? v[k] : low));
        if (high > low) { put(pixel + 0.3, Y(low)); put(pixel + 0.6, Y(high)); }
        put(pixel + 0.9, Y(v[n - 1] === v[n - 1] ? v[n - 1] : high));
      } else pen = "M";
      k = n;
    }
    return out.join("");
  }

  // Each value holds until the next row.
  function stepPath(t, v, X, Y, [from, to], end) {
    if (from >= to) return "";
    const out = [`M${at(X(t[from]), Y(v[from]))}`];
    let last = Y(v[from]);
    for (let k = from + 1; k < to; k++) {
      const y = Y(v[k]);
      if (y === last) continue;
      out.push(`H${X(t[k]).toFixed(1)}V${y.toFixed(1)}`);
      last = y;
    }
    out.push(`H${X(end).toFixed(1)}`);
    return out.join("");
  }

  // With times t, y is the rate of x: linear between the rows, and x cubic.
  function trackPath(x, y, X, Y, [from, to], t) {
    const out = [];
    let pen = "M", px = NaN, py = NaN;
    const put = (a, b) => {
      const u = X(a), w = Y(b);
      if (u !== u || w !== w) { pen = "M"; return; }
      if (pen === "L" && Math.abs(u - px) < 0.35 && Math.abs(w - py) < 0.35) return;
      out.push(pen + at(u, w));
      pen = "L"; px = u; py = w;
    };
    const pieces = t && to - from < 1500 ? 8 : 1;
    for (let k = from; k < to; k++) {
      for (let n = 1; n < pieces && k > from; n++) {
        const s = n / pieces, r = 1 - s, h = t[k] - t[k - 1];
        put((1 + 2 * s) * r * r * x[k - 1] + s * s * (3 - 2 * s) * x[k]
          + h * (s * r * r * y[k - 1] - s * s * r * y[k]), r * y[k - 1] + s * y[k]);
      }
      put(x[k], y[k]);
    }
    return out.join("");
  }

  const loop = (points, X, Y) => points.map(([x, y], k) =>
    x === null ? "" : (k && points[k - 1][0] !== null ? "L" : "M") + at(X(x), Y(y))).join("");

  // -- pieces of a figure ---------------------------------------------------------------------------

  function element(tag, attributes, parent, text) {
    const svg = ["svg", "g", "path", "rect", "line", "circle", "text", "clipPath", "polygon", "title"];
    const found = svg.includes(tag)
      ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) found.setAttribute(name, value);
    if (text !== undefined) found.textContent = text;
    parent?.append(found);
    return found;
  }

  // Caption with keys, and a drawing with a pane that can be zoomed.
  function frame(spec, height, B = 20) {
    const box = document.querySelector(`figure[data-figure="${spec.id}"]`);
    const caption = element("figcaption", {}, box);
    element("b", {}, caption, spec.title);
    const svg = element("svg", { role: "img", "aria-label": spec.title, tabindex: 0 }, box);
    const clip = element("rect", {}, element("clipPath", { id: `clip-${spec.id}` }, svg));
    const back = element("g", {}, svg);
    const inside = element("g", { "clip-path": `url(#clip-${spec.id})` }, svg);
    const front = element("g", { "clip-path": `url(#clip-${spec.id})` }, svg);
    const pane = element("rect", { class: "pane" }, svg);
    const select = element("rect", { class: "select", visibility: "hidden" }, svg);
    const shape = { box, caption, svg, back, inside, front, pane, select, width: 0, height, B };
    shape.measure = () => {
      shape.width = Math.max(box.clientWidth, 320);
      shape.height = typeof height === "function" ? height(shape.width) : height;
      svg.setAttribute("viewBox", `0 0 ${shape.width} ${shape.height}`);
      const inner = { x: L, y: T, width: shape.width - L - R, height: shape.height - T - B };
      for (const part of [clip, pane])
        for (const [name, value] of Object.entries(inner)) part.setAttribute(name, value);
      return inner;
    };
    return shape;
  }

  function key(caption, name, tone, kind, toggle) {
    const tag = toggle ? "button" : "div";
    const found = element(tag, { class: `key ${kind}`, style: `--c: var(--${tone})` }, caption);
    element("i", {}, found);
    found.append(name);
    if (toggle) found.onclick = () => { found.classList.toggle("off"); toggle(); };
    return { found };
  }

  // Powers of ten on an axis of logarithms, some seven at most.
  function powers(low, high) {
    const step = Math.max(Math.ceil((high - low) / 7), 1), found = [];
    for (let k = Math.ceil(low / step) * step; k <= high; k += step) found.push([k, `1e${k}`]);
    return found;
  }

  function axes(back, inner, [x0, x1], [y0, y1], X, Y, labels) {
    const right = inner.x + inner.width, bottom = inner.y + inner.height;
    const [sx, sy, bx, by] = [labels.sx ?? 1, labels.sy ?? 1, labels.bx ?? 0, labels.by ?? 0];
    const lines = { grid: "", zero: "" }, words = [];
    for (const [v, text] of ticks((x0 - bx) / sx, (x1 - bx) / sx, inner.width / 90)) {
      const x = X(v * sx + bx);
      lines[v === 0 && !bx && labels.plane ? "zero" : "grid"] += `M${at(x, T)}V${bottom}`;
      words.push([x, bottom + 14, "middle", labels.plane ? text : `${text} s`]);
    }
    for (const [v, text] of labels.yticks ?? ticks((y0 - by) / sy, (y1 - by) / sy, inner.height / 30)) {
      const y = Y(v * sy + by);
      lines[v === 0 && !by ? "zero" : "grid"] += `M${at(L, y)}H${right}`;
      words.push([L - 6, y + 4, "end", text]);
    }
    back.replaceChildren();
    for (const name of ["grid", "zero"]) element("path", { class: name, d: lines[name] }, back);
    for (const [x, y, anchor, text] of words)
      element("text", { x: x.toFixed(1), y: y.toFixed(1), "text-anchor": anchor }, back, text);
    if (labels.x)
      element("text", { x: L + inner.width / 2, y: bottom + 29, "text-anchor": "middle" }, back, labels.x);
    element("text", { x: 11, y: T + inner.height / 2, "text-anchor": "middle",
      transform: `rotate(-90 11 ${T + inner.height / 2})` }, back, labels.y);
    element("path", { class: "frame", d: `M${L} ${T}V${bottom}H${right}` }, back);
  }

  // -- pointer, wheel and keys; `area` says what a pixel means and what a choice does ------------------

  let steady = false; // a page that scrolls under a resting pointer must not zoom
  addEventListener("scroll", () => { steady = false; }, { passive: true });

  function interact(shape, area) {
    const { svg, pane, select } = shape;
    let start = null;
    const place = (event) => {
      const box = svg.getBoundingClientRect(), scale = shape.width / box.width;
      return [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
    };
    pane.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      start = place(event);
      start.move = event.shiftKey;
      start.hold = area.hold();
      pane.setPointerCapture(event.pointerId);
    });
    pane.addEventListener("pointermove", (event) => {
      const [x, y] = place(event);
      if (event.movementX || event.movementY) steady = true;
      if (!start) return area.hover(x, y);
      if (start.move) return area.move(start.hold, x - start[0], y - start[1]);
      const [low, high] = [Math.min(x, start[0]), Math.max(x, start[0])];
      const tall = area.flat ? [T, shape.height - shape.B] : [Math.min(y, start[1]), Math.max(y, start[1])];
      select.setAttribute("visibility", high - low > 4 ? "visible" : "hidden");
      const shown = { x: low, y: tall[0], width: high - low, height: tall[1] - tall[0] };
      for (const [name, value] of Object.entries(shown)) select.setAttribute(name, value);
    });
    pane.addEventListener("pointerup", (event) => {
      const [x, y] = place(event);
      if (start && !start.move && Math.abs(x - start[0]) > 4) area.choose(start, [x, y]);
      select.setAttribute("visibility", "hidden");
      start = null;
    });
    pane.addEventListener("pointercancel", () => { start = null; });
    pane.addEventListener("dblclick", () => area.reset());
    pane.addEventListener("wheel", (event) => {
      if (!steady || (event.deltaY > 0 && area.whole())) return; // the page scrolls
      event.preventDefault();
      area.zoom(1.0015 ** event.deltaY, place(event));
    }, { passive: false });
    svg.addEventListener("keydown", (event) => {
      const centre = [shape.width / 2, shape.height / 2];
      const act = {
        "+": () => area.zoom(0.7, centre), "-": () => area.zoom(1 / 0.7, centre),
        Escape: () => area.reset(), Home: () => area.reset(),
        ArrowLeft: () => area.move(area.hold(), shape.width / 8, 0),
        ArrowRight: () => area.move(area.hold(), -shape.width / 8, 0),
      }[event.key];
      if (act) { act(); event.preventDefault(); }
    });
  }

  function setView(from, to) {
    const least = 1e-7 * (page.end - page.start);
    const span = Math.min(Math.max(to - from, least), page.end - page.start);
    view.from = Math.min(Math.max(from, page.start), page.end - span);
    view.to = view.from + span;
    schedule();
  }

  function setCursor(t) {
    cursor = t === null ? null : Math.min(Math.max(t, page.start), page.end);
    schedule();
  }

  // What the pointer does on a pane whose x axis is time.
  function alongTime(shape, inverse) {
    return {
      flat: true,
      hold: () => ({ ...view }),
      hover: (x) => setCursor(inverse(x)),
      move: (hold, dx) => {
        const shift = dx * (hold.to - hold.from) / (shape.width - L - R);
        setView(hold.from - shift, hold.to - shift);
      },
      choose: ([a], [b]) => setView(Math.min(inverse(a), inverse(b)), Math.max(inverse(a), inverse(b))),
      zoom: (factor, [x]) => {
        const t = inverse(x);
        setView(t + (view.from - t) * factor, t + (view.to - t) * factor);
      },
      reset: () => setView(page.start, page.end),
      whole: () => view.from <= page.start && view.to >= page.end,
    };
  }

  // The other parts of the page register kinds of figures here.
  window.report = {
    page, view, column, rows, rowAt, held, fitted, short, amount, ticks, linePath, stepPath, trackPath,
    loop, element, frame, key, axes, powers, interact, alongTime, setView, setCursor, figures,
    margins: { L, R, T }, cursor: () => cursor, kinds: {},
  };
  let waiting = false;
  function schedule() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; draw(); });
  }
  function draw() {
    for (const figure of figures) figure.draw();
    Object.assign(section.dataset, { from: view.from, to: view.to, cursor: cursor ?? "" });
    const now = section.querySelector(".now");
    if (now) now.textContent = cursor === null ? "" : `t = ${cursor.toFixed(3)} s`;
  }

  window.report.start = () => {
    for (const spec of page.figures) figures.push(window.report.kinds[spec.kind](spec));
    for (const button of document.querySelectorAll("[data-span]"))
      button.onclick = () => setView(...button.dataset.span.split(" ").map(Number));
    for (const button of document.querySelectorAll("[data-time]"))
      button.onclick = () => {
        const t = Number(button.dataset.time), half = (page.end - page.start) / 40;
        setView(t - half, t + half);
        setCursor(t);
        section.scrollIntoView();
      };
    for (const button of document.querySelectorAll("[data-copy]"))
      button.onclick = () => navigator.clipboard?.writeText(button.dataset.copy);
    const wanted = matchMedia("(prefers-color-scheme: dark)");
    const paint = (dark) => { root.dataset.theme = dark ? "dark" : "light"; };
    paint(wanted.matches);
    wanted.addEventListener("change", () => paint(wanted.matches));
    document.querySelector(".theme").onclick = () => paint(root.dataset.theme !== "dark");
    let before; // paper is light
    addEventListener("beforeprint", () => { before = root.dataset.theme; paint(false); });
    addEventListener("afterprint", () => paint(before === "dark"));
    new ResizeObserver(schedule).observe(section);
    draw();
  };
})();
