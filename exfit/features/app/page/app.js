// The page: shows what the server says, and sends what someone does. It computes nothing.

import { Plot, number } from "./plot.js";

const STEPS = 1000; // of a slider
const $ = (id) => document.getElementById(id);
const state = { parameters: new Map(), plots: [], waiting: false, wanted: null, fitting: false, ended: false };

function make(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (key in made) made[key] = value;
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

// ---- messages

const socket = new WebSocket(new URL("live", location.href.replace(/^http/, "ws")));
socket.binaryType = "arraybuffer";
socket.onopen = () => send({ do: "open" });
socket.onclose = () => {
  state.ended = true;
  say("The server has ended. Changes are kept in the draft: start exfit app again.", true);
  for (const each of document.querySelectorAll("button, input, select")) each.disabled = true;
};
socket.onmessage = (event) => {
  const said = unpacked(event.data);
  (handlers[said.of] ?? (() => {}))(said);
  if (said.command) $("command").textContent = said.command;
};

function send(message) {
  if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function unpacked(buffer) {
  const size = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  const whole = (value) => {
    if (Array.isArray(value)) return value.map(whole);
    if (value === null || typeof value !== "object") return value;
    if ("at" in value && "n" in value) return new Float32Array(buffer, 4 + size + 4 * value.at, value.n);
    return Object.fromEntries(Object.entries(value).map(([key, entry]) => [key, whole(entry)]));
  };
  return whole(head);
}

function say(text, bad = false) {
  $("message").hidden = !text;
  $("message").className = bad ? "bad" : "";
  $("message").textContent = text;
}

// ---- sliders

const values = () =>
  Object.fromEntries([...state.parameters.values()].filter((p) => !p.locked).map((p) => [p.name, p.value]));

function placeOf(p, value) {
  const [low, high, at] = p.logarithmic ? [p.low, p.high, value].map(Math.log) : [p.low, p.high, value];
  return Math.max(0, Math.min(1, (at - low) / (high - low)));
}

function valueAt(p, place) {
  if (place <= 0) return p.low;
  if (place >= 1) return p.high;
  const value = p.logarithmic
    ? Math.exp(Math.log(p.low) + place * (Math.log(p.high) - Math.log(p.low)))
    : p.low + place * (p.high - p.low);
  return Number(value.toPrecision(5));
}

function addParameter(p) {
  const bounded = p.low !== null && p.high !== null;
  const id = `p-${p.name}`, words = [p.meaning, p.unit].filter(Boolean).join(", ");
  p.slider = make("input", {
    type: "range", min: 0, max: STEPS, step: 1, disabled: p.locked || !bounded, "aria-label": `${p.name} slider`,
    oninput: () => move(p, valueAt(p, p.slider.value / STEPS)), onchange: () => store(p),
  });
  p.box = make("input", {
    type: "number", id, step: "any", disabled: p.locked,
    onchange: () => { move(p, Number(p.box.value)); store(p); },
  });
  const end = (which) => make("input", {
    type: "number", step: "any", value: p[which] === null ? "" : number(p[which]), disabled: p.locked,
    "aria-label": `${which === "low" ? "lower" : "upper"} bound of ${p.name}`,
    onchange: (event) => bound(p, which, Number(event.target.value)),
  });
  p.ends = { low: end("low"), high: end("high") };
  p.band = make("div", { className: "band", hidden: true });
  p.inner = make("div", { className: "inner" }, p.band, p.slider);
  p.handles = p.locked || !bounded ? {} : { low: handle(p, "low"), high: handle(p, "high") };
  const lock = make("button", {
    type: "button", className: "small", "aria-pressed": String(p.locked), "aria-label": `Hold ${p.name}`,
    onclick: () => send(p.locked ? { do: "free", name: p.name } : { do: "lock", name: p.name, value: p.value }),
  }, p.locked ? "free" : "hold");
  const profile = make("button", {
    type: "button", className: "small", disabled: p.locked, "aria-label": `Profile of ${p.name}`,
    onclick: () => { say(`profile of ${p.name}: fits the case at other values of it …`); send({ do: "profile", name: p.name }); },
  }, "profile");
  p.text = make("div", { className: "quiet" });
  $("parameters").append(make("div", { className: "parameter" },
    make("div", { className: "head" }, make("label", { htmlFor: id, title: words }, p.name), p.box, make("span", { className: "quiet" }, p.unit)),
    make("div", { className: "track" }, p.inner, ...Object.values(p.handles)),
    make("div", { className: "ends" }, p.ends.low, make("span", { className: "buttons" }, lock, profile), p.ends.high),
    p.text));
  state.parameters.set(p.name, p);
  show(p);
}

function handle(p, which) { // drags a bound: within the track up to the value, without it as far as there is room
  const upper = which === "high", room = 0.14, own = make("div", { className: `handle ${which}`, role: "slider", tabIndex: 0, "aria-label": `drag the ${upper ? "upper" : "lower"} bound of ${p.name}` });
  let place = upper ? 1 : 0, dragged = false;
  const valueOf = (k) => Number((p.logarithmic ? p.low * (p.high / p.low) ** k : p.low + k * (p.high - p.low)).toPrecision(3));
  const told = () => {
    own.style.setProperty("--place", place);
    own.setAttribute("aria-valuenow", valueOf(place));
    own.setAttribute("aria-valuetext", `${number(valueOf(place))} ${p.unit}`);
  };
  const to = (wanted) => {
    const value = placeOf(p, p.value);
    place = upper ? Math.max(value, Math.min(1 + room, wanted)) : Math.min(value, Math.max(-room, wanted));
    p.ends[which].value = valueOf(place);
    told();
  };
  const done = () => {
    if (place !== (upper ? 1 : 0)) bound(p, which, valueOf(place));
  };
  own.back = () => { place = upper ? 1 : 0; told(); };
  own.setAttribute("aria-valuemin", valueOf(-room));
  own.setAttribute("aria-valuemax", valueOf(1 + room));
  told();
  own.addEventListener("pointerdown", (event) => { dragged = true; own.setPointerCapture(event.pointerId); });
  own.addEventListener("pointermove", (event) => {
    const box = p.inner.getBoundingClientRect();
    if (dragged) to((event.clientX - box.left) / box.width);
  });
  own.addEventListener("pointerup", () => { dragged = false; done(); });
  own.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: -0.01, ArrowDown: -0.01, ArrowRight: 0.01, ArrowUp: 0.01, PageDown: -0.1, PageUp: 0.1 }[event.key];
    if (!way) return;
    event.preventDefault();
    to(place + way);
  });
  own.addEventListener("keyup", done);
  return own;
}

function bound(p, which, value) { // a fault puts back the one in force
  state.back = () => {
    p.ends[which].value = p[which] === null ? "" : number(p[which]);
    p.handles[which]?.back();
  };
  send({ do: "bound", name: p.name, low: p.low, high: p.high, [which]: value });
}

function show(p) {
  p.box.value = number(p.value);
  if (p.low === null || p.high === null) return;
  p.slider.value = Math.round(STEPS * placeOf(p, p.value));
  p.slider.setAttribute("aria-valuetext", `${number(p.value)} ${p.unit}`);
}

function move(p, value) {
  p.value = value;
  show(p);
  state.began ??= performance.now(); // of the oldest movement that is not drawn yet
  state.wanted = values();
  state.moving = true;
  ask();
}

function rest() { // the steps of what is shown while a slider moves are those of the start values
  state.wanted = values();
  state.moving = false;
  ask();
}

function ask() { // one question at a time: what the hand has done meanwhile is the next one
  if (state.waiting || !state.wanted) return;
  state.waiting = true;
  state.asked = state.began;
  state.began = null;
  send({ do: "try", values: state.wanted, moving: state.moving });
  state.wanted = null;
}

function store(p) {
  send({ do: "store", values: { [p.name]: p.value } });
  rest();
}

// ---- responses

function showRecords(records) {
  $("records").replaceChildren();
  state.plots = [];
  for (const record of records) {
    const box = make("article", {}, make("h3", {}, record.name === "fit" ? record.file : `${record.name}: ${record.file}`));
    const plots = { box, signals: new Map() };
    for (const note of record.notes) box.append(make("p", { className: "quiet" }, note));
    if (record.match) box.append(make("p", { className: record.accepted ? "good" : "bad" }, [record.match, record.reason].filter(Boolean).join(": ")));
    for (const signal of record.signals) {
      const figures = make("span", { className: "quiet" }), readout = make("p", { className: "readout" });
      const [upper, lower] = [make("canvas"), make("canvas", { className: "low" })];
      box.append(make("div", { className: "signal" }, make("p", {}, `${signal.label} `, figures), upper, lower, readout));
      plots.signals.set(signal.signal, {
        label: signal.label, figures, time: signal.time,
        upper: new Plot(upper, readout, ["measured", "start", "current"], "s"),
        lower: new Plot(lower, readout, ["residual"], "s"),
      });
    }
    plots.table = make("table");
    box.append(plots.table);
    $("records").append(box);
    state.plots.push(plots);
  }
  update(records);
}

function update(records) {
  records.forEach((record, k) => {
    const plots = state.plots[k];
    for (const signal of record.signals) {
      const plot = plots.signals.get(signal.signal);
      plot.figures.textContent = `rmse ${signal.rmse} pu, fit ${signal.fit} %`;
      const { measured, start, current } = signal;
      plot.upper.set(plot.time, start ? { measured, start, current } : { current });
      plot.lower.set(plot.time, { residual: signal.residual });
      plot.upper.canvas.setAttribute("aria-label", `${plot.label}, measured, start and current: ${plot.figures.textContent}`);
      plot.lower.canvas.setAttribute("aria-label", `${plot.label}, current less measured`);
    }
    table(plots.table, ["", "measured", "current"], record.features.map((f) => [`${f.label}, ${f.unit}`, f.measured, f.simulated]));
  });
}

function table(into, heads, rows) {
  into.hidden = !rows.length;
  into.replaceChildren(
    make("thead", {}, make("tr", {}, ...heads.map((text) => text ? make("th", { scope: "col" }, text) : make("td")))),
    make("tbody", {}, ...rows.map((row) => make("tr", {}, ...row.map((cell) => make("td", {}, cell))))));
}

function refocused(rebuild) { // what is made anew has the keyboard where it was
  const name = document.activeElement?.getAttribute("aria-label"), id = document.activeElement?.id;
  rebuild();
  const again = id ? $(id) : name && [...document.querySelectorAll("[aria-label]")].find((each) => each.getAttribute("aria-label") === name);
  if (again && again !== document.activeElement) again.focus({ preventScroll: true });
}

function corrections(channel) {
  const changed = () => send({ do: "correct", column: channel.name, signal: is.value, unit: unit.value });
  const unit = make("input", { type: "text", className: "unit", value: channel.unit, placeholder: "pu", "aria-label": `unit of ${channel.name}`, onchange: changed });
  const is = make("select", { "aria-label": `signal of ${channel.name}`, onchange: changed },
    ...["", ...state.signals].map((name) => make("option", { value: name, selected: name === channel.signal }, name || "–")));
  return [unit, is];
}

function machineForm(rows) {
  $("machine").replaceChildren(...rows.map((row) => make("p", { className: "field" },
    make("label", { htmlFor: `m-${row.name}`, title: row.meaning }, `${row.name}, ${row.unit}`),
    make("input", { id: `m-${row.name}`, type: "number", step: "any", placeholder: String(row.typical), min: row.low, max: row.high }))));
}

function planned() { // the planner's file has the model, and the machine's data where no others are given
  const unit = state.planner.units[$("unit").selectedIndex];
  machineForm(unit.machine);
  $("model").value = unit.exciter;
  $("model").disabled = true;
  if (state.signals) send({ do: "drawing", model: unit.exciter });
}

// ---- what the server says

const handlers = {
  start() {
    only("start");
    $("title").textContent = "nothing open yet";
  },
  channels(said) {
    refocused(() => {
      const channels = make("table");
      table(channels, ["channel", "unit", "is", "level", "noise"], said.channels.map((c) => [c.name, ...corrections(c), c.level, c.noise]));
      $("channels").replaceChildren(channels);
    });
    $("findings").replaceChildren(...said.findings.map((finding) => make("li", {}, finding)));
    say("");
  },
  planner(said) {
    state.planner = said;
    $("planner").hidden = false;
    $("unit").replaceChildren(...said.units.map((unit) => make("option", {}, unit.name)));
    planned();
    say(state.signals ? "" : `${said.file}: ${said.units.map((unit) => unit.name).slice(0, 5).join("; ")}: open the record of a unit`);
  },
  record(said) {
    only("begin");
    $("actions").hidden = true;
    drafted(false);
    $("name").textContent = said.file;
    $("title").textContent = "a record";
    state.signals = said.signals;
    handlers.channels(said);
    $("curves").replaceChildren();
    for (const [name, curve] of Object.entries(said.curves)) {
      const canvas = make("canvas", { className: "low", "aria-label": `channel ${name} over time` }), readout = make("p", { className: "readout" });
      $("curves").append(make("h3", {}, name), canvas, readout);
      new Plot(canvas, readout, ["current"], "s").set(said.time, { current: curve });
    }
    $("model").replaceChildren(...said.models.map((name) => make("option", { selected: name === "AC1A" }, name)));
    state.machine = said.machine;
    $("model").disabled = false;
    if (said.planner) handlers.planner(said.planner);
    else machineForm(said.machine);
    send({ do: "drawing", model: $("model").value });
    say("");
  },
  drawing(said) {
    const src = `data:image/svg+xml,${encodeURIComponent(said.svg)}`;
    $("drawing").replaceChildren(said.svg ? make("img", { src, alt: `block diagram: ${said.title}` }) : "no drawing");
  },
  open(said) {
    only("work");
    $("actions").hidden = false;
    $("name").textContent = said.name;
    document.title = `${said.name} – exfit`;
    $("title").textContent = said.title;
    state.parameters.clear();
    state.began = state.wanted = state.back = null;
    state.waiting = false;
    refocused(() => {
      $("parameters").replaceChildren();
      said.parameters.forEach(addParameter);
    });
    $("given").replaceChildren(make("option", { value: "" }, "choose …"), ...said.given.map((name) => make("option", {}, name)));
    $("more").hidden = !said.given.length;
    $("from").textContent = `at the start ${number(said.cost)}`;
    $("cost").textContent = number(said.cost);
    showRecords(said.records);
    drafted(said.draft);
    say(said.words ?? "");
    if (said.result) handlers.fit(said.result);
    else for (const id of ["outcome"]) $(id).hidden = true;
    for (const id of ["save-result", "save-report"]) $(id).disabled = !said.result;
  },
  try(said) {
    requestAnimationFrame(() => {
      update(said.records);
      $("cost").textContent = number(said.cost);
      if (state.asked) performance.measure("slider", { start: state.asked, end: performance.now() });
      state.waiting = false;
      ask();
    });
  },
  store(said) { drafted(said.draft); },
  saved(said) {
    if ("draft" in said) drafted(said.draft);
    say(`saved: ${said.words}`);
  },
  iteration(said) {
    $("outcome").hidden = false;
    const box = $("iterations"), names = Object.keys(said.values);
    box.hidden = false;
    if (!box.firstChild) box.append(make("table", {}, make("thead", {}, make("tr", {}, ...["", "phase", "cost", ...names].map((n) => n ? make("th", { scope: "col" }, n) : make("td")))), make("tbody")));
    const row = [said.number, said.phase, number(said.cost), ...names.map((n) => number(said.values[n]))];
    box.querySelector("tbody").append(make("tr", {}, ...row.map((cell) => make("td", {}, String(cell)))));
    box.scrollTop = box.scrollHeight;
    $("cost").textContent = number(said.cost);
    follow(said.values);
  },
  stage(said) { $("verdict").textContent = said.words; },
  live(said) {
    const plot = state.plots[0]?.signals.get(said.signal);
    if (plot && plot.time.length === said.time.length) plot.upper.set(null, { current: said.current });
  },
  fit(said) {
    fitting(false);
    $("outcome").hidden = false;
    $("verdict").textContent = said.reason ? `${said.verdict}: ${said.reason}` : said.verdict;
    $("verdict").className = said.holds ? "good" : "bad";
    for (const id of ["save-result", "save-report"]) $(id).disabled = false;
    const found = make("table");
    table(found, ["parameter", "value", "95 % interval", "unit"], said.parameters.map((p) => [p.name, p.text, p.interval ? p.words : "none", p.unit]));
    const causes = make("ol", {}, ...said.causes.map((cause) => make("li", {}, cause.sentence, " ",
      cause.command ? make("button", { type: "button", className: "small", title: cause.command, onclick: () => send({ do: "apply", cause: cause.number }) }, "Apply") : "",
      cause.command ? make("code", {}, ` ${cause.command}`) : "")));
    const validation = make("ul", { className: "plain" }, ...said.validation.map((v) => make("li", { className: v.accepted ? "good" : "bad" },
      `${v.name}: ${v.accepted ? "accepted" : "not accepted"}, ${v.match}${v.reason ? `: ${v.reason}` : ""}`)));
    $("found").replaceChildren(make("p", { className: "quiet" }, said.outcome), found,
      ...(said.causes.length ? [make("h3", {}, "Likely causes"), causes] : []),
      ...(said.validation.length ? [make("h3", {}, "Validation"), validation] : []));
    bands(said.parameters);
    follow(Object.fromEntries(said.parameters.filter((p) => !p.of_record).map((p) => [p.name, p.value])));
    rest();
  },
  profile(said) {
    say("");
    $("outcome").hidden = false;
    const canvas = make("canvas", { className: "small" }), readout = make("p", { className: "readout" });
    $("profile").replaceChildren(make("h3", {}, `Profile of ${said.name}: ${said.words} ${said.unit}`), canvas, readout,
      make("p", { className: "quiet" }, `rise of the cost over ${said.name}; the interval ends where it reaches ${number(said.limit)}`));
    canvas.setAttribute("aria-label", `profile of ${said.name}, ${said.words} ${said.unit}`);
    const plot = new Plot(canvas, readout, ["current", "start"], said.unit);
    plot.set(said.at, { current: said.rise, start: said.at.map(() => said.limit) });
  },
  validate(said) { showRecords(said.records); },
  fault(said) {
    fitting(false);
    if (state.waiting) { state.waiting = false; ask(); }
    state.back?.();
    state.back = null;
    say(said.lines.join("\n"), true);
  },
};

function bands(parameters) {
  for (const found of parameters) {
    const p = state.parameters.get(found.name);
    if (!p || p.low === null || p.high === null) continue;
    p.band.hidden = !found.interval;
    p.text.textContent = found.interval ? `95 %: ${found.words}` : found.words;
    if (!found.interval) continue;
    const [low, high] = found.interval.map((end, k) => (end === null ? k : placeOf(p, Math.max(end, p.logarithmic ? p.low : end))));
    p.band.style.left = `${100 * low}%`;
    p.band.style.width = `${Math.max(100 * (high - low), 0.6)}%`;
  }
}

function follow(found) {
  for (const [name, value] of Object.entries(found)) {
    const p = state.parameters.get(name);
    if (p && !p.locked) { p.value = value; show(p); }
  }
}

function drafted(name) {
  $("draft").hidden = $("discard").hidden = !name;
  $("draft").textContent = name ? `draft: ${name}` : "";
}

function fitting(on) {
  state.fitting = on;
  $("fit").disabled = on;
  $("stop").hidden = !on;
  if (on) { $("iterations").replaceChildren(); $("found").replaceChildren(); $("verdict").textContent = "fits …"; $("verdict").className = ""; }
}

$("fit").onclick = () => { say(""); fitting(true); $("outcome").hidden = false; send({ do: "fit" }); };
$("stop").onclick = () => send({ do: "stop" });
$("validate").onclick = () => send({ do: "validate", values: values() });
for (const [id, what] of [["save-case", "save case"], ["save-result", "save result"], ["save-report", "save report"], ["discard", "discard"]]) {
  $(id).onclick = () => { if (what.startsWith("save")) say(`${what} …`); send({ do: what }); };
}
$("given").onchange = (event) => event.target.value && send({ do: "free", name: event.target.value });
$("copy").onclick = async () => {
  await navigator.clipboard.writeText($("command").textContent);
  $("copy").textContent = "Copied";
};

// ---- from a record

const only = (id) => ["start", "begin", "work"].forEach((each) => { $(each).hidden = each !== id; });
const given = (id) => ($(id).value === "" ? null : Number($(id).value));
$("unit").onchange = planned;
$("model").onchange = () => send({ do: "drawing", model: $("model").value });
$("make").onclick = () => {
  const boxes = [...document.querySelectorAll("#machine input")].filter((box) => box.value !== "");
  const machine = Object.fromEntries(boxes.map((box) => [box.id.slice(2), Number(box.value)]));
  const unit = state.planner ? $("unit").selectedIndex : 0;
  send({ do: "make", model: $("model").value, unit, step: given("step"), kv: given("kv"), machine });
};
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => {
  event.preventDefault();
  take([...event.dataTransfer.files]);
});
$("file").onchange = () => {
  take([...$("file").files]);
  $("file").value = "";
};

async function take(files) { // of a COMTRADE record all files are kept, then its .cfg is read
  if (!files.length || state.ended) return;
  say(`reads ${files.map((file) => file.name).join(", ")} …`);
  for (const file of files) {
    const answer = await fetch(`file?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file });
    if (!answer.ok) return say(await answer.text(), true);
  }
  send({ do: "look", file: (files.find((file) => /\.cfg$/i.test(file.name)) ?? files[0]).name });
}
