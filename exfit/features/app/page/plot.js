// A plot of curves over time on a canvas, with the values under the pointer or the arrow keys.

const ROOM = { left: 58, right: 10, top: 8, bottom: 22 };
const LABEL = 14; // px from one label of an axis to the next

export class Plot {
  // `names` are the curves, drawn in this order; each has the colour of its name in the style
  constructor(canvas, readout, names, unit) {
    Object.assign(this, { canvas, readout, names, unit, curves: {}, time: [], cursor: null });
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.addEventListener("pointermove", (event) => this.point(event.offsetX));
    canvas.addEventListener("pointerleave", () => this.point(null));
    canvas.addEventListener("keydown", (event) => this.step(event));
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  set(time, curves) {
    if (time) this.time = time;
    Object.assign(this.curves, curves);
    this.draw();
  }

  ends(arrays) {
    let low = Infinity, high = -Infinity;
    for (const array of arrays) {
      for (const value of array) {
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    return low <= high ? [low, high] : [0, 1];
  }

  draw() {
    const { canvas, time } = this, scale = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !time.length) return;
    if (canvas.width !== Math.round(width * scale)) canvas.width = Math.round(width * scale);
    if (canvas.height !== Math.round(height * scale)) canvas.height = Math.round(height * scale);
    const pen = canvas.getContext("2d"), style = getComputedStyle(canvas);
    const colour = (name) => style.getPropertyValue(`--${name}`);
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, width, height);
    const shown = this.names.filter((name) => this.curves[name]);
    let [low, high] = this.ends(shown.map((name) => this.curves[name]));
    const margin = 0.06 * (high - low) || 1e-3 * Math.abs(high) || 1e-3;
    [low, high] = [low - margin, high + margin];
    const begin = time[0], end = time[time.length - 1];
    const x = (t) => ROOM.left + ((t - begin) / (end - begin || 1)) * (width - ROOM.left - ROOM.right);
    const y = (v) => ROOM.top + ((high - v) / (high - low)) * (height - ROOM.top - ROOM.bottom);
    this.x = x;
    pen.font = `12px ${style.fontFamily}`;
    pen.fillStyle = colour("quiet");
    pen.strokeStyle = colour("edge");
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    let written = Infinity; // height of the label below, which the next one leaves legible
    for (const tick of ticks(low, high, Math.max(2, height / 55))) {
      line(pen, ROOM.left, y(tick.at), width - ROOM.right, y(tick.at));
      if (written - y(tick.at) < LABEL) continue;
      written = y(tick.at);
      pen.fillText(tick.text, ROOM.left - 6, written);
    }
    pen.textAlign = "center";
    pen.textBaseline = "top";
    const instants = ticks(begin, end, width / 110);
    if (instants.length) instants[instants.length - 1].text += ` ${this.unit}`;
    for (const tick of instants) {
      pen.fillText(tick.text, Math.min(x(tick.at), width - ROOM.right - 14), height - ROOM.bottom + 6);
    }
    for (const name of shown) {
      pen.strokeStyle = colour(name);
      pen.lineWidth = name === "current" ? 2 : 1.4;
      pen.setLineDash(name === "start" ? [5, 4] : []);
      curve(pen, time, this.curves[name], x, y);
    }
    pen.setLineDash([]);
    if (this.cursor !== null) {
      pen.strokeStyle = colour("quiet");
      pen.lineWidth = 1;
      line(pen, x(time[this.cursor]), ROOM.top, x(time[this.cursor]), height - ROOM.bottom);
    }
  }

  point(across) {
    const { time } = this;
    this.cursor = null;
    if (across !== null && time.length && this.x) {
      let low = 0, high = time.length - 1;
      while (low < high) {
        const middle = (low + high) >> 1;
        if (this.x(time[middle]) < across) low = middle + 1;
        else high = middle;
      }
      this.cursor = low;
    }
    this.tell();
  }

  step(event) {
    const way = { ArrowLeft: -1, ArrowRight: 1, PageDown: -20, PageUp: 20 }[event.key];
    if (!way) return;
    event.preventDefault();
    const last = this.time.length - 1;
    this.cursor = Math.max(0, Math.min(last, (this.cursor ?? 0) + way));
    this.tell();
  }

  tell() {
    const k = this.cursor;
    const named = this.names.filter((name) => this.curves[name]);
    const words = named.map((name) => `${name} ${number(this.curves[name][k])}`);
    this.readout.textContent = k === null ? "" : `${number(this.time[k])} ${this.unit}: ${words.join(", ")}`;
    this.draw();
  }
}

function line(pen, a, b, c, d) {
  pen.beginPath();
  pen.moveTo(a, b);
  pen.lineTo(c, d);
  pen.stroke();
}

function curve(pen, time, values, x, y) {
  let down = false; // what is left out breaks the line
  pen.beginPath();
  for (let k = 0; k < time.length; k += 1) {
    const value = values[k];
    if (Number.isNaN(value)) down = false;
    else if (down) pen.lineTo(x(time[k]), y(value));
    else {
      pen.moveTo(x(time[k]), y(value));
      down = true;
    }
  }
  pen.stroke();
}

export function ticks(low, high, most) {
  const rough = (high - low) / most, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((each) => each * power >= rough);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), found = [];
  for (let at = Math.ceil(low / step) * step; at <= high; at += step) {
    found.push({ at, text: at.toFixed(Math.min(decimals, 9)) });
  }
  return found.length > 1 || !(high > low) ? found : ticks(low, high, 2 * most); // one shows no scale
}

export function number(value) {
  if (!Number.isFinite(value)) return "–";
  return value && Math.abs(value) < 1e-3 ? value.toExponential(4) : String(Number(value.toPrecision(5)));
}
