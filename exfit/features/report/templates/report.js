"use strict";
// The drawings of records are zoomed and read off by the samples that lie in the page. Without
// scripts, and on paper, they stay as they are.
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const LINES = ["measured", "start", "reference", "simulated"]; // as they lie in a drawing
  const MILLI = 1e3, ROOM = 0.06; // of the range, above and below the lines
  const RESTS = 1e-6, NARROW = 0.05, LEAST_LEVEL = 0.1; // as charts.py draws a signal that rests
  const PER_TICK = [80, 22]; // units of a drawing
  const FEWEST = 4; // samples in sight
  const CLICK = 6, BOX = 14; // units: a shorter drag is none, a lower one selects a time alone
  const views = new Map(); // of each record: its range of time, and its drawings

  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  const numbers = (values) => Float64Array.from(values, (value) => (value === null ? NaN : value));

  function make(space, name, attributes, text = "") {
    const made = space ? document.createElementNS(SVG, name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.textContent = text;
    return made;
  }

  function ticks(low, high, length, room) {
    const most = Math.max(3, Math.floor(length / room));
    const found = ticksOf(low, high, length, most);
    return found.length > 1 ? found : ticksOf(low, high, length, 2 * most);
  }

  function ticksOf(low, high, length, most) {
    const least = (high - low) / most, power = 10 ** Math.floor(Math.log10(least));
    const step = power * [1, 2, 5, 10].find((each) => each * power >= least * (1 - 1e-9));
    const order = Math.floor(Math.log10(step) + 1e-9), found = [];
    for (let k = Math.ceil(low / step - 1e-9); k <= high / step + 1e-9; k++) {
      const value = k * step, digits = value ? Math.floor(Math.log10(Math.abs(value))) - order + 1 : 1;
      const label = order >= -5 ? value.toFixed(Math.max(0, -order)) : String(Number(value.toPrecision(Math.max(digits, 3))));
      found.push({at: ((value - low) / (high - low)) * length, label: label.replace(/^-(?=[0.]+$)/, "")});
    }
    return found;
  }

  // rows of the samples between two times, and one beyond each
  function rowsWithin(time, [start, end]) {
    const first = time.findIndex((t) => t >= start), beyond = time.findIndex((t) => t > end);
    return [Math.max(0, first - 1), beyond < 0 ? time.length - 1 : beyond];
  }

  function spanOf(lines, first, last) {
    let low = Infinity, high = -Infinity;
    for (const line of lines) {
      for (let k = first; k <= last; k++) {
        if (line[k] < low) low = line[k];
        if (line[k] > high) high = line[k];
      }
    }
    if (low > high) return [0, 1];
    const level = Math.max(Math.abs(low), Math.abs(high));
    const room = high - low <= RESTS * level ? NARROW * Math.max(level, LEAST_LEVEL) : ROOM * (high - low);
    return [low - room, high + room];
  }

  function panelOf(group, lines, figure, k) {
    const {width, height, start, end, low, high} = Object.fromEntries(
      Object.entries(group.dataset).map(([key, value]) => [key, Number(value)]));
    const clip = make(true, "clipPath", {id: `${figure.id}-clip-${k}`});
    clip.append(make(true, "rect", {width, height}));
    group.parentNode.prepend(clip);
    group.querySelector(".marks").setAttribute("clip-path", `url(#${clip.id})`);
    return {group, lines, width, height, whole: [low, high], start, end, drawn: group.cloneNode(true), box: null};
  }

  // as drawn at first where the whole record is in sight
  function restore(panel) {
    panel.group.replaceChildren(...panel.drawn.cloneNode(true).childNodes);
    Object.assign(panel.group.dataset, panel.drawn.dataset);
  }

  function redraw(drawing) {
    const {time, panels, view} = drawing, [start, end] = view.range;
    const [first, last] = rowsWithin(time, view.range);
    drawing.figure.classList.toggle("zoomed", !isWhole(view));
    for (const panel of panels) {
      restore(panel);
      if (isWhole(view) && !panel.box) continue;
      const {group, width, height} = panel;
      const [low, high] = panel.box ?? spanOf(panel.lines, first, last);
      const across = (t) => ((t - start) / (end - start)) * width;
      const upward = (y) => height - ((y - low) / (high - low)) * height;
      Object.assign(group.dataset, {start, end, low, high});
      const beside = ticks(low, high, height, PER_TICK[1]), below = ticks(start, end, width, PER_TICK[0]);
      group.querySelector(".lines").setAttribute("d", [
        ...beside.map((tick) => `M0 ${(height - tick.at).toFixed(1)}h${width}`),
        ...below.map((tick) => `M${tick.at.toFixed(1)} 0v${height}`)].join(""));
      group.querySelector(".end").replaceChildren(...beside.map(
        (tick) => make(true, "text", {x: -7, y: (height - tick.at + 4).toFixed(1)}, tick.label)));
      const foot = group.querySelector(".x-ticks");
      foot?.replaceChildren(...below.map(
        (tick) => make(true, "text", {x: tick.at.toFixed(1), y: height + 18}, tick.label)));
      group.querySelector(".level")?.setAttribute("d", `M0 ${upward(0).toFixed(1)}h${width}`);
      group.querySelectorAll(".mark").forEach((mark, k) => {
        const line = panel.lines[k], dots = mark.classList.contains("dots"), path = [];
        let pen = "M";
        for (let row = first; row <= last; row++) {
          if (Number.isNaN(line[row])) { pen = "M"; continue; }
          path.push(`${pen}${across(time[row]).toFixed(1)} ${upward(line[row]).toFixed(1)}`);
          if (dots) path.push("h0"); else pen = "L";
        }
        mark.setAttribute("d", path.join(""));
      });
    }
  }

  const isWhole = (view) => view.range[0] === view.whole[0] && view.range[1] === view.whole[1];

  // all drawings of a record; a box also selects a range of values in its panel
  function show(view, start, end, boxed = null, box = null) {
    const [from, to] = view.whole, length = clamp(end - start, view.least, to - from);
    const begin = clamp(length > end - start ? (start + end - length) / 2 : start, from, to - length);
    view.range = length >= to - from ? [...view.whole] : [begin, begin + length];
    for (const drawing of view.drawings) {
      for (const panel of drawing.panels) panel.box = panel === boxed ? box : null;
      redraw(drawing);
    }
  }

  function zoomAt(view, at, factor) {
    const [start, end] = view.range;
    show(view, at - (at - start) * factor, at + (end - at) * factor);
  }

  function tools(drawing) {
    const {view} = drawing, bar = make(false, "p", {class: "tools"});
    const middle = () => (view.range[0] + view.range[1]) / 2;
    const move = (share) => {
      const [start, end] = view.range, by = share * (end - start);
      show(view, clamp(start + by, view.whole[0], view.whole[1] - (end - start)), clamp(end + by, view.whole[0] + (end - start), view.whole[1]));
    };
    for (const [sign, label, act] of [
      ["−", "zoom out", () => zoomAt(view, middle(), 2)],
      ["+", "zoom in", () => zoomAt(view, middle(), 0.5)],
      ["←", "earlier", () => move(-0.5)],
      ["→", "later", () => move(0.5)],
      ["whole", "show the whole record", () => show(view, ...view.whole)],
    ]) {
      const button = make(false, "button", {type: "button", "aria-label": label, title: label}, sign);
      button.addEventListener("click", act);
      bar.append(button);
    }
    drawing.figure.prepend(bar);
  }

  function place(panel, event) {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(panel.group.getScreenCTM().inverse());
    const within = at.x >= 0 && at.x <= panel.width && at.y >= 0 && at.y <= panel.height;
    return {x: clamp(at.x, 0, panel.width), y: clamp(at.y, 0, panel.height), within};
  }

  const timeAt = (view, panel, x) => view.range[0] + (x / panel.width) * (view.range[1] - view.range[0]);

  function forget(drawing) {
    drawing.readout.hidden = true;
    for (const line of drawing.figure.querySelectorAll(".cursor")) line.remove();
  }

  function read(drawing, event) {
    const panel = drawing.panels.find((each) => place(each, event).within);
    forget(drawing);
    if (!panel) return;
    const {time, view, readout, figure} = drawing, at = timeAt(view, panel, place(panel, event).x);
    const after = time.findIndex((t) => t >= at), row = after < 0 ? time.length - 1
      : after > 0 && at - time[after - 1] < time[after] - at ? after - 1 : after;
    const x = ((time[row] - view.range[0]) / (view.range[1] - view.range[0])) * panel.width;
    if (x < -0.5 || x > panel.width + 0.5) return;
    for (const each of drawing.panels) {
      each.group.append(make(true, "path", {class: "cursor", d: `M${x.toFixed(1)} 0v${each.height}`}));
    }
    const value = (line, digits) => (Number.isNaN(line[row]) ? "–" : line[row].toFixed(digits));
    const said = [["time", `${time[row].toFixed(4)} s`],
      ...drawing.names.map((name, k) => [name, value(drawing.panels[0].lines[k], 5)]),
      ["difference (1e-3 pu)", value(drawing.panels[1].lines[0], 3)]];
    readout.replaceChildren(...said.flatMap(([name, text]) => [make(false, "dt", {}, name), make(false, "dd", {}, text)]));
    readout.hidden = false;
    const frame = figure.getBoundingClientRect(), across = event.clientX - frame.left, room = readout.offsetWidth;
    readout.style.left = `${clamp(across > frame.width / 2 ? across - room - 16 : across + 16, 0, frame.width - room)}px`;
    readout.style.top = `${clamp(event.clientY - frame.top - 20, 0, frame.height - readout.offsetHeight)}px`;
  }

  function followPointer(drawing, svg) {
    const {view} = drawing;
    let drag = null;
    const end = () => { drag?.frame.remove(); drag = null; };
    svg.addEventListener("pointerdown", (event) => {
      const panel = drawing.panels.find((each) => place(each, event).within);
      if (!panel || event.button !== 0) return;
      const frame = panel.group.appendChild(make(true, "rect", {class: "frame"}));
      drag = {panel, frame, from: place(panel, event), range: [...view.range], moves: event.shiftKey};
      svg.setPointerCapture(event.pointerId);
      read(drawing, event);
    });
    svg.addEventListener("pointermove", (event) => {
      if (!drag) { read(drawing, event); return; }
      forget(drawing);
      const {panel, from, frame, range, moves} = drag, to = place(panel, event);
      if (moves) {
        const by = ((from.x - to.x) / panel.width) * (range[1] - range[0]);
        const held = clamp(by, view.whole[0] - range[0], view.whole[1] - range[1]);
        show(view, range[0] + held, range[1] + held);
        return;
      }
      const tall = event.pointerType !== "touch" && Math.abs(to.y - from.y) > BOX;
      for (const [key, value] of Object.entries({
        x: Math.min(from.x, to.x), width: Math.abs(to.x - from.x),
        y: tall ? Math.min(from.y, to.y) : 0, height: tall ? Math.abs(to.y - from.y) : panel.height,
      })) frame.setAttribute(key, value);
    });
    svg.addEventListener("pointerup", (event) => {
      if (!drag) return;
      const {panel, from, moves} = drag, to = place(panel, event);
      end();
      if (moves || Math.abs(to.x - from.x) < CLICK) return;
      const [low, high] = [Number(panel.group.dataset.low), Number(panel.group.dataset.high)];
      const level = (y) => high - (y / panel.height) * (high - low);
      const tall = event.pointerType !== "touch" && Math.abs(to.y - from.y) > BOX;
      const times = [from.x, to.x].sort((a, b) => a - b).map((x) => timeAt(view, panel, x));
      show(view, ...times, panel, tall ? [from.y, to.y].map(level).sort((a, b) => a - b) : null);
    });
    svg.addEventListener("pointercancel", () => { end(); forget(drawing); });
    svg.addEventListener("pointerleave", () => { if (!drag) forget(drawing); });
    svg.addEventListener("dblclick", () => show(view, ...view.whole));
    svg.addEventListener("wheel", (event) => {
      const panel = drawing.panels.find((each) => place(each, event).within);
      if (!event.ctrlKey || !panel) return;
      event.preventDefault();
      zoomAt(view, timeAt(view, panel, place(panel, event).x), 2 ** clamp(event.deltaY / 200, -1, 1));
    }, {passive: false});
  }

  function enliven(match) {
    const figure = document.getElementById(match.key), svg = figure.querySelector("svg.static");
    const time = numbers(match.time), names = LINES.filter((name) => match[name]);
    const lines = names.map((name) => numbers(match[name])), simulated = numbers(match.simulated);
    const error = lines[0].map((value, k) => MILLI * (simulated[k] - value));
    const panels = [...svg.querySelectorAll(".panel")].map((group, k) => panelOf(group, k ? [error] : lines, figure, k));
    const whole = [panels[0].start, panels[0].end];
    const fresh = {whole, range: [...whole], least: (FEWEST * (whole[1] - whole[0])) / time.length, drawings: []};
    const view = views.get(match.group) ?? fresh;
    const labels = [...figure.querySelectorAll(".legend li")].map((item) => item.textContent);
    const readout = make(false, "dl", {class: "readout", "aria-hidden": "true", hidden: ""});
    const drawing = {figure, time, panels, view, readout, names: labels};
    views.set(match.group, view);
    view.drawings.push(drawing);
    figure.append(readout);
    tools(drawing);
    followPointer(drawing, svg);
    figure.classList.add("alive");
  }

  // without scripts a long history stands open, and so it is printed; drawings are printed whole
  function preparePrint() {
    const every = [...document.querySelectorAll("details.long")];
    const drawings = () => [...views.values()].flatMap((view) => view.drawings);
    let shut = [];
    for (const details of every) details.open = false;
    window.addEventListener("beforeprint", () => {
      shut = every.filter((details) => !details.open);
      for (const details of shut) details.open = true;
      for (const drawing of drawings()) { forget(drawing); drawing.panels.forEach(restore); }
    });
    window.addEventListener("afterprint", () => {
      for (const details of shut) details.open = false;
      drawings().forEach(redraw);
    });
  }

  const every = JSON.parse(document.getElementById("samples").textContent);
  preparePrint();
  every.forEach(enliven);
  for (const hint of document.querySelectorAll(".hint")) hint.hidden = every.length === 0;
  document.documentElement.dataset.ready = "true";
})();
