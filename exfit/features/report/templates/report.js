"use strict";
// Each drawing of a record gets an interactive twin; where that fails the drawing stays.
(() => {
  const COLOURS = {measured: "#7b828c", start: "#2b6cb0", simulated: "#c1272d"};
  const MILLI = 1e3;
  const touch = window.matchMedia("(pointer: coarse)").matches;
  const ranges = new Map();

  function numbers(values) {
    return Float64Array.from(values, (value) => (value === null ? NaN : value));
  }

  // the overlays of a record are documents of their own, and follow each other along the time
  function range(match) {
    const start = match.time[0], end = match.time[match.time.length - 1];
    const own = new Bokeh.Range1d({start, end, bounds: [start, end]});
    const alike = ranges.get(match.group) ?? [];
    ranges.set(match.group, [...alike, own]);
    own.change.connect(() => {
      for (const other of ranges.get(match.group)) {
        if (other.start !== own.start || other.end !== own.end) {
          other.setv({start: own.start, end: own.end});
        }
      }
    });
    return own;
  }

  function source(match) {
    const data = {time: numbers(match.time), measured: numbers(match.measured), simulated: numbers(match.simulated)};
    if (match.start) data.start = numbers(match.start);
    data.residual = data.simulated.map((value, k) => MILLI * (value - data.measured[k]));
    return new Bokeh.ColumnDataSource({data});
  }

  function panel(time, height, label) {
    const wheel = new Bokeh.WheelZoomTool({modifiers: {ctrl: true}, zoom_on_axis: false});
    const box = new Bokeh.BoxZoomTool();
    const plot = Bokeh.Plotting.figure({
      height, x_range: time, sizing_mode: "stretch_width", output_backend: "canvas",
      tools: [new Bokeh.PanTool(), box, wheel, new Bokeh.ResetTool()],
      active_drag: null, toolbar_location: "above", x_axis_label: null, y_axis_label: null, min_border_left: 60, min_border_right: 12,
    });
    plot.title.text = label;
    plot.title.text_font_style = "normal";
    plot.toolbar.logo = null;
    plot.toolbar.active_drag = touch ? null : box;
    plot.toolbar.active_scroll = wheel;
    for (const axis of [...plot.xaxes, ...plot.yaxes]) {
      axis.axis_label_text_font_style = "normal";
      axis.minor_tick_line_color = null;
    }
    plot.outline_line_color = null;
    return plot;
  }

  function hover(plot, renderer, names) {
    const tooltips = [["time", "@time{0.0000} s"], ...names.map((name) => [name, `@${name}{0.00000}`])];
    plot.add_tools(new Bokeh.HoverTool({renderers: [renderer], mode: "vline", tooltips}));
  }

  function draw(match, place) {
    const from = source(match), time = {field: "time"}, shared = range(match);
    const upper = panel(shared, 300, match.label);
    const names = ["measured", ...(match.start ? ["start"] : []), "simulated"];
    upper.scatter(time, {field: "measured"}, {source: from, size: 3, color: COLOURS.measured, line_color: null});
    if (match.start) {
      upper.line(time, {field: "start"}, {source: from, color: COLOURS.start, line_dash: "dashed", line_width: 1.5});
    }
    const line = upper.line(time, {field: "simulated"}, {source: from, color: COLOURS.simulated, line_width: 2});
    hover(upper, line, names);
    const lower = panel(shared, 150, "simulated - measured (1e-3 pu)");
    lower.toolbar_location = null;
    const error = lower.line(time, {field: "residual"}, {source: from, color: COLOURS.simulated});
    hover(lower, error, ["residual"]);
    lower.xaxes[0].axis_label = "time (s)";
    return Bokeh.Plotting.show(new Bokeh.Column({children: [upper, lower], sizing_mode: "stretch_width"}), place);
  }

  async function enliven(match) {
    const figure = document.getElementById(match.key);
    const place = document.getElementById(`${match.key}-live`);
    place.hidden = false;
    try {
      await draw(match, place);
      figure.classList.add("alive");
    } catch (fault) {
      place.hidden = true;
      console.warn(`${match.key} stays a drawing`, fault);
    }
  }

  // without scripts a long history stands open, and so it is printed
  function fold() {
    const every = [...document.querySelectorAll("details.long")];
    let shut = [];
    for (const details of every) details.open = false;
    window.addEventListener("beforeprint", () => {
      shut = every.filter((details) => !details.open);
      for (const details of shut) details.open = true;
    });
    window.addEventListener("afterprint", () => {
      for (const details of shut) details.open = false;
    });
  }

  async function main() {
    fold();
    if (typeof Bokeh === "undefined") return;
    Bokeh.logger?.set_level?.("warn");
    const every = JSON.parse(document.getElementById("samples").textContent);
    for (const match of every) await enliven(match);
    for (const hint of document.querySelectorAll(".hint")) hint.hidden = touch || every.length === 0;
    document.documentElement.dataset.ready = "true";
  }

  main();
})();
