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
  function range(one) {
    const start = one.time[0], end = one.time[one.time.length - 1];
    const own = new Bokeh.Range1d({start, end, bounds: [start, end]});
    const alike = ranges.get(one.group) ?? [];
    ranges.set(one.group, [...alike, own]);
    own.change.connect(() => {
      for (const other of ranges.get(one.group)) {
        if (other.start !== own.start || other.end !== own.end) {
          other.setv({start: own.start, end: own.end});
        }
      }
    });
    return own;
  }

  function source(one) {
    const data = {time: numbers(one.time), measured: numbers(one.measured), simulated: numbers(one.simulated)};
    if (one.start) data.start = numbers(one.start);
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

  function draw(one, place) {
    const from = source(one), time = {field: "time"}, shared = range(one);
    const upper = panel(shared, 300, one.label);
    const names = ["measured", ...(one.start ? ["start"] : []), "simulated"];
    upper.scatter(time, {field: "measured"}, {source: from, size: 3, color: COLOURS.measured, line_color: null});
    if (one.start) {
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

  async function enliven(one) {
    const figure = document.getElementById(one.key);
    const place = document.getElementById(`${one.key}-live`);
    place.hidden = false;
    try {
      await draw(one, place);
      figure.classList.add("alive");
    } catch (fault) {
      place.hidden = true;
      console.warn(`${one.key} stays a drawing`, fault);
    }
  }

  // without scripts a long history stands open, and so it is printed
  function fold() {
    const every = [...document.querySelectorAll("details.long")];
    let shut = [];
    for (const one of every) one.open = false;
    window.addEventListener("beforeprint", () => {
      shut = every.filter((one) => !one.open);
      for (const one of shut) one.open = true;
    });
    window.addEventListener("afterprint", () => {
      for (const one of shut) one.open = false;
    });
  }

  async function main() {
    fold();
    if (typeof Bokeh === "undefined") return;
    Bokeh.logger?.set_level?.("warn");
    const every = JSON.parse(document.getElementById("samples").textContent);
    for (const one of every) await enliven(one);
    for (const hint of document.querySelectorAll(".hint")) hint.hidden = touch || every.length === 0;
    document.documentElement.dataset.ready = "true";
  }

  main();
})();
