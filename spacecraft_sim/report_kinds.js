// The kinds of figures of report.html: histories, thrust lanes, planes, the spacecraft itself.
"use strict";
(() => {
  const { page, view, column, rows, held, fitted, short, amount, linePath, stepPath, trackPath, loop,
    element, frame, key, axes, powers, interact, alongTime, setView, setCursor, margins, cursor,
  } = window.report;
  const { L, T } = margins;
  const kinds = window.report.kinds;
  const timeAxis = (inner) => {
    const scale = inner.width / (view.to - view.from);
    return [(t) => L + (t - view.from) * scale, (x) => view.from + (x - L) / scale];
  };

  function cursorLine(front, X, inner) {
    const t = cursor();
    if (t === null || t < view.from || t > view.to) return;
    const x = X(t).toFixed(1);
    element("path", { class: "cursor", d: `M${x} ${T}V${T + inner.height}` }, front);
  }

  // -- curves over time; the y axis fits what the span of time shows --------------------------------

  kinds.history = (spec) => {
    const shape = frame(spec, 176);
    let X, inverse, fit = false;
    const keys = {}; // curves of one name share a key, which then reads out none
    const traces = spec.traces.map((trace) => {
      const shared = spec.traces.filter(({ name }) => name === trace.name).length > 1;
      const look = keys[trace.name]
        ?? key(shape.caption, trace.name, trace.tone, trace.dashed ? "dashed" : "", draw);
      keys[trace.name] = look;
      const plain = shared || trace.draw === "stem";
      const value = element("span", plain ? {} : { class: "value" }, plain ? null : look.found);
      const path = element("path", { class: "trace", "data-name": trace.name,
        style: `--c: var(--${trace.tone})`, "stroke-width": trace.width }, shape.inside);
      if (trace.dashed) path.setAttribute("stroke-dasharray", "5 4");
      if (trace.faint) path.setAttribute("stroke-opacity", 0.35);
      return { ...trace, ...look, value, path, t: column(trace.t), v: column(trace.y) };
    });
    for (const band of spec.bands) {
      const { found } = key(shape.caption, band.name, "good", band.faint ? "dashed" : "fill", () => {
        fit = !fit;
        found.classList.remove("off");
        draw();
      });
      found.title = "fit the axis to the bound, or to the curves";
    }
    const marks = (spec.marks ?? []).map((mark) => {
      const found = element("polygon", { class: `worst ${mark.holds ? "holds" : ""}` }, shape.svg);
      element("title", {}, found, mark.text);
      found.onclick = () => setCursor(mark.t);
      return { ...mark, found };
    });

    // Least and largest value shown, the curve cut off at the edges of the window.
    function reach() {
      let low = Infinity, high = -Infinity;
      const grow = (v) => { if (v < low) low = v; if (v > high) high = v; };
      for (const { t, v, found, draw: how } of traces) {
        if (found.classList.contains("off")) continue;
        const [from, to] = rows(t, view.from, view.to);
        for (let k = from; k < to; k++) {
          if (t[k] >= view.from && t[k] <= view.to) { grow(v[k]); continue; }
          const [edge, n] = t[k] < view.from ? [view.from, k + 1] : [view.to, k - 1];
          if (n < 0 || n >= t.length) continue;
          grow(how === "step" ? v[Math.min(k, n)] : v[k] + (v[n] - v[k]) * (edge - t[k]) / (t[n] - t[k]));
        }
        if (how === "stem") grow(0);
      }
      for (const { low: a, high: b, faint } of spec.bands)
        if (fit || (!faint && b - a < 2.5 * (high - low))) { grow(a); grow(b); }
      if (!(high >= low)) [low, high] = [-1, 1];
      const pad = 0.06 * (high - low) || 0.1 * Math.abs(high) || 1e-9;
      return [spec.floor === undefined ? low - pad : spec.floor, high + pad];
    }

    function draw() {
      const inner = shape.measure();
      [X, inverse] = timeAxis(inner);
      const [y0, y1] = reach();
      const Y = (v) => T + inner.height * (1 - (v - y0) / (y1 - y0));
      const [sy, unit, by] = spec.log ? [1, spec.unit, 0] : fitted(spec.unit, y0, y1);
      axes(shape.back, inner, [view.from, view.to], [y0, y1], X, Y,
        { y: unit, sy, by, yticks: spec.log ? powers(y0, y1) : undefined });
      for (const { low, high, faint } of spec.bands) {
        const [a, b] = [Y(high), Y(low)].map((y) => Math.min(Math.max(y, T - 2), T + inner.height + 2));
        const place = { x: L, y: a, width: inner.width, height: Math.max(b - a, 1) };
        if (!faint) element("rect", { class: "band", ...place }, shape.back);
        element("path", { class: `limit ${faint ? "faint" : ""}`, d: [a, b].map((y) =>
          y > T - 1 && y < T + inner.height + 1 ? `M${L} ${y}H${L + inner.width}` : "").join("") },
        shape.back);
      }
      shape.front.replaceChildren();
      cursorLine(shape.front, X, inner);
      for (const { t, v, path, found, value, draw: how, tone } of traces) {
        const shown = rows(t, view.from, view.to);
        let d = "";
        if (!found.classList.contains("off")) {
          if (how === "step") d = stepPath(t, v, X, Y, shown, Math.min(view.to, page.end));
          else if (how === "stem")
            for (let k = shown[0]; k < shown[1]; k++) d += `M${X(t[k]).toFixed(1)} ${Y(0)}V${Y(v[k]).toFixed(1)}`;
          else d = linePath(t, v, X, Y, shown, inner.width);
        }
        path.setAttribute("d", d);
        const now = cursor();
        const read = v[held(t, now ?? 0)];
        value.textContent = now === null || how === "stem" ? ""
          : amount(spec.log ? 10 ** read : read, spec.unit);
        if (d && now !== null && how !== "stem" && now >= view.from && now <= view.to) {
          const k = held(t, now);
          element("circle", { class: "dot", r: 3, style: `--c: var(--${tone})`,
            cx: X(t[k]).toFixed(1), cy: Y(v[k]).toFixed(1) }, shape.front);
        }
      }
      for (const { t, found } of marks) {
        const x = X(t), seen = t >= view.from && t <= view.to;
        found.setAttribute("points", seen ? `${x - 4},${T - 7} ${x + 4},${T - 7} ${x},${T}` : "");
      }
    }
    interact(shape, alongTime(shape, (x) => inverse(x)));
    return { draw };
  };

  // -- thrust: a lane a channel, on a logarithmic scale of its levels --------------------------------

  kinds.lanes = (spec) => {
    const few = spec.channels.length === 1;
    const tall = few ? 118 : 46, above = few ? 0 : 13; // room for the name of a lane
    const shape = frame(spec, T + 20 + tall * spec.channels.length);
    let X, inverse;
    key(shape.caption, "delivered +", "plus", "fill");
    key(shape.caption, "delivered −", "minus", "fill");
    const commanded = element("span", {}, key(shape.caption, "commanded", "ink", "").found);
    const still = element("span", { class: "key words" }, shape.caption);
    const lanes = spec.channels.map((channel) => {
      const paths = {};
      for (const [name, tone, kind] of [["plus", "plus", "area"], ["minus", "minus", "area"],
        ["command", "ink", "trace"]])
        paths[name] = element("path", { class: kind, "data-name": `${channel.name} ${name}`,
          style: `--c: var(--${tone})` }, shape.inside);
      const label = element("text", { x: L + 5 }, shape.svg);
      const [delivered, command] = [channel.delivered, channel.command]
        .map(({ t, y }) => ({ t: column(t), v: column(y) }));
      const least = channel.levels[0] ?? 1, most = channel.levels.at(-1) ?? 1;
      const high = 1 + Math.log10(most / least);
      const height = (v) => {
        const size = Math.abs(v) / least;
        return Math.sign(v) * (size < 1 ? size : 1 + Math.log10(size)) / high;
      };
      return { ...channel, paths, label, delivered, command, height };
    });

    function draw() {
      const inner = shape.measure();
      [X, inverse] = timeAxis(inner);
      const marks = [];
      let hidden = false;
      lanes.forEach((lane, k) => {
        const { delivered, command, height, paths, levels, unit, name, label } = lane;
        const middle = T + tall * k + (tall + above) / 2;
        const Y = (v) => middle - 0.46 * (tall - above) * height(v);
        for (const level of few ? [0, ...levels.filter((_, n) => n === 0 || n === levels.length - 1)
          .flatMap((v) => [v, -v])] : [0])
          marks.push([-Y(level), few ? (level > 0 ? "+" : "") + short(level, 3) : "0"]);
        for (const [way, sign] of [["plus", 1], ["minus", -1]]) {
          const part = (v) => Y(sign * Math.max(sign * v, 0));
          const shown = rows(delivered.t, view.from, view.to);
          const edge = stepPath(delivered.t, delivered.v, X, part, shown, view.to);
          paths[way].setAttribute("d", edge && `${edge}V${middle.toFixed(1)}H${X(delivered.t[shown[0]]).toFixed(1)}Z`);
        }
        const shown = rows(command.t, view.from, view.to);
        const dense = shown[1] - shown[0] > inner.width / 3; // a line would hide what it crosses
        if (dense) hidden = true;
        paths.command.setAttribute("d", dense ? "" : stepPath(command.t, command.v, X, Y, shown, view.to));
        paths.command.setAttribute("stroke-width", few ? 1.1 : 0.9);
        label.setAttribute("y", T + tall * k + 10);
        const now = cursor();
        const reading = now === null ? `±${short(levels.at(-1) ?? 0, 3)} ${unit}`
          : `${amount(delivered.v[held(delivered.t, now)], unit)}, commanded `
            + amount(command.v[held(command.t, now)], unit);
        label.textContent = few ? "" : `${name}  ${reading}`;
        if (few) still.textContent = now === null ? "" : reading;
      });
      commanded.textContent = hidden ? "(zoom in to see it)" : "";
      axes(shape.back, inner, [view.from, view.to], [0, 1], X, (y) => -y,
        { y: few ? `${lanes[0].unit}, log levels` : "log levels", yticks: marks });
      shape.front.replaceChildren();
      cursorLine(shape.front, X, inner);
    }
    interact(shape, alongTime(shape, (x) => inverse(x)));
    return { draw };
  };

  // -- two quantities over each other: phase planes and maps; the tracks show the span of time ----------

  kinds.plane = (spec) => {
    const shape = frame(spec, (width) => Math.min(Math.max(0.72 * width, 250), 560), 36);
    let window = null, X, Y, back; // null: what the figure asks for, or what fits the tracks
    const [regions, lines, tracks] = [spec.regions, spec.lines, spec.tracks].map((parts, n) =>
      parts.map((part) => {
        const kind = ["fill solid", part.dashed ? "dashed" : "", ""][n];
        const look = part.name && !parts.slice(0, parts.indexOf(part)).some((p) => p.name === part.name)
          ? key(shape.caption, part.name, part.tone, kind, n ? () => draw() : undefined) : undefined;
        const path = element("path", { class: ["region", "trace", "trace"][n], "data-name": part.name,
          style: `--c: var(--${part.tone})`, "stroke-width": part.width ?? 0 }, shape.inside);
        if (part.dashed) path.setAttribute("stroke-dasharray", "6 4");
        const data = n === 2
          ? { t: column(part.t), x: column(part.x), y: column(part.y) } : {};
        return { ...part, ...data, path, found: look?.found };
      }));
    for (const band of spec.bands) key(shape.caption, band.name, "good", "fill");

    function reach() {
      if (window) return window;
      if (spec.window) return spec.window;
      const box = [Infinity, -Infinity, Infinity, -Infinity];
      for (const { t, x, y, found } of tracks) {
        if (found?.classList.contains("off")) continue;
        for (let [k, to] = rows(t, view.from, view.to); k < to; k++) {
          if (x[k] < box[0]) box[0] = x[k];
          if (x[k] > box[1]) box[1] = x[k];
          if (y[k] < box[2]) box[2] = y[k];
          if (y[k] > box[3]) box[3] = y[k];
        }
      }
      const pads = [0, 2].map((n) => 0.06 * (box[n + 1] - box[n]) || Math.abs(0.1 * box[n]) || 1e-9);
      return [box[0] - pads[0], box[1] + pads[0], box[2] - pads[1], box[3] + pads[1]];
    }

    function draw() {
      const inner = shape.measure();
      const [x0, x1, y0, y1] = reach();
      X = (v) => L + (v - x0) / (x1 - x0) * inner.width;
      Y = (v) => T + inner.height * (1 - (v - y0) / (y1 - y0));
      back = [(x) => x0 + (x - L) / inner.width * (x1 - x0),
        (y) => y0 + (1 - (y - T) / inner.height) * (y1 - y0)];
      const [[sx, ux, bx], [sy, uy, by]] = [fitted(spec.x.unit, x0, x1), fitted(spec.y.unit, y0, y1)];
      const label = (axis, unit) => (unit ? `${axis.name}, ${unit}` : axis.name);
      axes(shape.back, inner, [x0, x1], [y0, y1], X, Y,
        { x: label(spec.x, ux), y: label(spec.y, uy), sx, sy, bx, by, plane: true });
      for (const { low, high } of spec.bands) {
        const [a, b] = [X(low), X(high)].map((x) => Math.min(Math.max(x, L), L + inner.width));
        element("rect", { class: "band", x: a, y: T, width: b - a, height: inner.height }, shape.back);
      }
      for (const { points, path } of regions) path.setAttribute("d", `${loop(points, X, Y)}Z`);
      for (const { points, path, found } of lines)
        path.setAttribute("d", found?.classList.contains("off") ? "" : loop(points, X, Y));
      shape.front.replaceChildren();
      for (const { t, x, y, path, found, tone, dotted } of tracks) {
        const off = found?.classList.contains("off");
        path.setAttribute("d", off ? "" : trackPath(x, y, X, Y, rows(t, view.from, view.to), spec.smooth && t));
        const now = cursor();
        const k = now === null ? 0 : held(t, now);
        if (off || !dotted || (now === null && view.from > page.start) || x[k] !== x[k]) continue;
        element("circle", { class: "dot", r: 4, style: `--c: var(--${now === null ? "ink" : tone})`,
          cx: X(x[k]).toFixed(1), cy: Y(y[k]).toFixed(1) }, shape.front);
      }
      for (const { x, y, name } of spec.points) {
        const dot = element("circle", { class: "dot", r: 5, style: "--c: var(--bad)",
          cx: X(x).toFixed(1), cy: Y(y).toFixed(1) }, shape.front);
        element("title", {}, dot, name);
      }
    }

    const moved = (box) => { window = box; draw(); };
    interact(shape, {
      flat: false,
      hold: () => ({ box: reach(), X, Y, back }),
      hover: (px, py) => { // the nearest point of the track takes the cursor
        const { t, x, y } = tracks.find((track) => track.dotted) ?? {};
        if (!t) return;
        let best = 900, found = null;
        for (let [k, to] = rows(t, view.from, view.to); k < to; k++) {
          const d = (X(x[k]) - px) ** 2 + (Y(y[k]) - py) ** 2;
          if (d < best) { best = d; found = k; }
        }
        if (found !== null) setCursor(t[found]);
      },
      move: ({ box, back: [bx, by] }, dx, dy) => {
        const [u, v] = [bx(dx) - bx(0), by(dy) - by(0)];
        moved([box[0] - u, box[1] - u, box[2] - v, box[3] - v]);
      },
      choose: (a, b) => {
        const [xs, ys] = [[a[0], b[0]].map(back[0]), [a[1], b[1]].map(back[1])];
        if (ys[0] === ys[1]) return;
        moved([Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)]);
      },
      zoom: (factor, [px, py]) => {
        const [x, y] = [back[0](px), back[1](py)], box = reach();
        moved(box.map((v, n) => (n < 2 ? x + (v - x) * factor : y + (v - y) * factor)));
      },
      reset: () => { if (window) moved(null); else setView(page.start, page.end); },
      whole: () => window === null,
    });
    return { draw };
  };

  // -- the spacecraft at the cursor -------------------------------------------------------------------

  kinds.craft = (spec) => {
    const shape = frame(spec, (width) => Math.min(0.6 * width, 340));
    const times = column(spec.t), [right, up, near] = spec.axes;
    let factor = spec.factor;
    const choose = element("button", { title: "how much the bending is exaggerated" }, shape.caption);
    choose.hidden = !spec.booms.length;
    choose.onclick = () => {
      factor = spec.factors[(spec.factors.indexOf(factor) + 1) % spec.factors.length];
      draw();
    };
    const instant = element("span", { class: "key words" }, shape.caption);
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const cross = (a, b) =>
      [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    const turned = ([w, ...v], p) => {
      const c = cross(v, p).map((x) => 2 * x), d = cross(v, c);
      return p.map((x, n) => x + w * c[n] + d[n]);
    };

    // Corners of the least convex outline of points of the screen.
    function hull(points) {
      const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
      const half = (side) => {
        const kept = [];
        for (const p of side) {
          while (kept.length > 1) {
            const [a, b] = kept.slice(-2);
            if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
            kept.pop();
          }
          kept.push(p);
        }
        return kept.slice(0, -1);
      };
      return [...half(sorted), ...half(sorted.reverse())];
    }

    // Numbers of one frame, or between two of them.
    function frameAt(key, width) {
      const data = column(key), t = Math.min(Math.max(cursor() ?? view.from, times[0]), times.at(-1));
      const k = Math.min(held(times, t), times.length - 2);
      const s = (t - times[k]) / (times[k + 1] - times[k]);
      return Array.from({ length: width }, (_, n) =>
        data[k * width + n] * (1 - s) + data[(k + 1) * width + n] * s);
    }

    function draw() {
      shape.measure();
      const outlines = [];
      const middle = [shape.width / 2, shape.height / 2];
      const scale = 0.94 * Math.min(shape.width / spec.reach[0], shape.height / spec.reach[1]);
      const project = (p) => [middle[0] + scale * (dot(p, right) - spec.middle[0]),
        middle[1] - scale * (dot(p, up) - spec.middle[1])];
      choose.textContent = `bending × ${factor}`;
      shape.back.replaceChildren();
      for (const { key: poses, shapes } of spec.bodies) {
        const pose = frameAt(poses, 7), place = pose.slice(0, 3), size = Math.hypot(...pose.slice(3));
        const turn = pose.slice(3).map((x) => x / size);
        for (const { points, faces, rgb } of shapes) {
          const world = points.map((p) => turned(turn, p).map((x, n) => x + place[n]));
          const flat = world.map(project), along = world.map((p) => dot(p, near));
          // Of shapes about one centre the longer is behind: a strut runs through a hull.
          const middle = world[0].map((_, m) => world.reduce((sum, p) => sum + p[m], 0) / world.length);
          const size = Math.max(...world.map((p) => Math.hypot(...p.map((x, m) => x - middle[m]))));
          const depth = along.reduce((a, b) => a + b, 0) / along.length - 1e-3 * size;
          if (!faces.length) outlines.push([depth, hull(flat), rgb, 1]);
          for (const face of faces) {
            const side = (n) => world[face[n]].map((x, m) => x - world[face[0]][m]);
            const normal = cross(side(1), side(2)), towards = dot(normal, near) / Math.hypot(...normal);
            if (towards > 1e-6)
              outlines.push([depth, face.map((n) => flat[n]), rgb, 0.65 + 0.35 * towards]);
          }
        }
      }
      spec.booms.forEach(({ key: points, shares, name }, k) => {
        const flat = frameAt(points, 3 * shares.length + 3); // hinges and tip; where it would be unbent
        const at = (n) => flat.slice(3 * n, 3 * n + 3);
        const [foot, tip] = [at(0), at(shares.length)];
        const bent = shares.map((share, n) => {
          const straight = foot.map((x, m) => x + share * (tip[m] - x)), there = at(n);
          return project(straight.map((x, m) => x + factor * (there[m] - x)));
        });
        const d = (line) => `M${line.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L")}`;
        element("path", { class: "unbent", d: d([foot, tip].map(project)) }, shape.back);
        element("path", { class: "boom", "data-name": name, d: d(bent),
          style: `--c: var(--boom-${k % 5})` }, shape.back);
      });
      for (const [, corners, rgb, light] of outlines.sort((a, b) => a[0] - b[0]))
        element("polygon", { class: "body", fill: `rgb(${rgb.map((c) => Math.round(c * light))})`,
          points: corners.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ") }, shape.back);
      const t = cursor() ?? view.from;
      instant.textContent = `t = ${t.toFixed(2)} s, ${spec.seen}`;
    }
    shape.pane.remove();
    return { draw };
  };

  window.report.start();
})();
