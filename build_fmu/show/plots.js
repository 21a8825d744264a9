// The plots: curves over time, a legend with the values at the cursor; a click sets the current time.
const LEFT = 60, RIGHT = 10, TOP = 6, BOTTOM = 20;

function shown(x) {
  if (!isFinite(x)) return "–";
  const size = Math.abs(x);
  if (size === 0) return "0";
  if (size < 1e-3 || size >= 1e5) return power(x.toExponential(2));
  return x.toFixed(size < 1 ? 4 : size < 100 ? 2 : 1).replace("-", "−");
}
// 1.5e-8 as 1.5·10⁻⁸
function power(text) {
  const [number, exponent] = text.replace("-", text[0] === "-" ? "−" : "-").split("e");
  return `${number}·10${exponent.replace("+", "").replace(/./g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]))}`;
}
function tickText(x, step) {
  if (Math.abs(x) < step * 1e-6) return "0";
  const size = Math.max(Math.abs(x), step);
  if (size < 1e-3 || size >= 1e5) return power(x.toExponential(Math.max(0, Math.floor(Math.log10(size)) - Math.floor(Math.log10(step)))));
  return x.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9))).replace("-", "−");
}
function ticks(from, to, most) {
  const step = niceStep((to - from) / most), found = [];
  for (let k = Math.ceil(from / step - 1e-9); k * step <= to + 1e-9 * step; k++) found.push(k * step);
  return [found, step];
}

class Panel {
  constructor(parent, panel, seek) {
    this.curves = panel.curves.map((curve, i) => ({ ...curve, values: columns.get(curve.name), on: true,
      colour: curve.joint >= 0 ? colourOf(curve.joint, panel.joints) : colourOf(i, panel.curves.length) }));
    const box = document.createElement("article");
    box.className = "panel";
    const title = document.createElement("h2"), small = document.createElement("small");
    title.textContent = panel.title;
    small.textContent = panel.unit ? `in ${panel.unit}` : "";
    title.append(small);
    this.chart = document.createElement("div");
    this.chart.className = "chart";
    this.canvas = document.createElement("canvas");
    this.cursor = document.createElement("div");
    this.cursor.className = "cursor";
    this.chart.append(this.canvas, this.cursor);
    this.legend = document.createElement("div");
    this.legend.className = "legend";
    box.append(title, this.chart, this.legend);
    parent.append(box);
    this.factor = panel.factor;
    this.noise = panel.noise;
    this.still = panel.still;
    this.fillLegend();
    this.listen(seek);
  }
  fillLegend() {
    for (const curve of this.curves) {
      const entry = document.createElement("button"), line = document.createElement("i"), name = document.createElement("span");
      curve.shown = document.createElement("b");
      line.style.color = curve.colour;
      name.textContent = curve.label;
      entry.title = "click: hide or show";
      entry.append(line, name, curve.shown);
      entry.onclick = () => {
        curve.on = !curve.on;
        entry.classList.toggle("off", !curve.on);
        this.draw();
      };
      this.legend.append(entry);
    }
  }
  listen(seek) {
    const go = (event) => {
      const rect = this.chart.getBoundingClientRect();
      const part = (event.clientX - rect.left - LEFT) / Math.max(1, rect.width - LEFT - RIGHT);
      seek(startTime + Math.min(1, Math.max(0, part)) * (stopTime - startTime));
    };
    this.chart.onpointerdown = (event) => {
      this.chart.setPointerCapture(event.pointerId);
      go(event);
    };
    this.chart.onpointermove = (event) => {
      if (event.buttons) go(event);
    };
  }
  range() {
    let low = Infinity, high = -Infinity;
    for (const curve of this.curves)
      if (curve.on) for (const x of curve.values.subarray(0, time.length)) if (isFinite(x)) [low, high] = [Math.min(low, x), Math.max(high, x)];
    if (!(high >= low)) [low, high] = [-1, 1];
    low *= this.factor;
    high *= this.factor;
    this.most = Math.max(Math.abs(low), Math.abs(high));
    // do not magnify rounding errors, of the simulation or of the stored values (24 bits)
    if (high - low <= Math.max(this.noise, 2e-7 * this.most)) {
      const half = Math.max(this.still, 1e-3 * this.most);
      return [(low + high) / 2 - half, (low + high) / 2 + half];
    }
    const margin = 0.06 * (high - low) || Math.abs(high) || 1;
    return [low - margin, high + margin];
  }
  draw() {
    const scale = window.devicePixelRatio || 1, width = this.chart.clientWidth, height = this.chart.clientHeight;
    if (!width) return;
    this.canvas.width = width * scale;
    this.canvas.height = height * scale;
    const ink = this.canvas.getContext("2d");
    ink.setTransform(scale, 0, 0, scale, 0, 0);
    const [low, high] = this.range();
    const x = (t) => LEFT + (width - LEFT - RIGHT) * (t - startTime) / (stopTime - startTime || 1);
    const y = (v) => TOP + (height - TOP - BOTTOM) * (high - v) / (high - low);
    ink.font = "11px system-ui, 'DejaVu Sans', sans-serif";
    ink.fillStyle = css("--soft");
    ink.lineWidth = 1;
    ink.strokeStyle = css("--grid");
    const line = (x0, y0, x1, y1) => {
      ink.beginPath();
      ink.moveTo(x0, y0);
      ink.lineTo(x1, y1);
      ink.stroke();
    };
    const [across, stepX] = ticks(startTime, stopTime, Math.max(3, width / 90)), [upward, stepY] = ticks(low, high, height / 27);
    ink.textBaseline = "middle";
    ink.textAlign = "right";
    for (const v of upward) {
      ink.strokeStyle = css(Math.abs(v) < stepY * 1e-6 ? "--line" : "--grid");
      line(LEFT, y(v), width - RIGHT, y(v));
      ink.fillText(tickText(v, stepY), LEFT - 6, y(v));
    }
    ink.textBaseline = "alphabetic";
    ink.strokeStyle = css("--grid");
    across.forEach((t, i) => {
      line(x(t), TOP, x(t), height - BOTTOM);
      ink.textAlign = x(t) > width - RIGHT - 24 ? "right" : "center";
      ink.fillText(tickText(t, stepX) + (i === across.length - 1 ? " s" : ""), Math.min(x(t), width - 2), height - 5);
    });
    ink.save();
    ink.beginPath();
    ink.rect(LEFT, TOP - 2, width - LEFT - RIGHT + 1, height - TOP - BOTTOM + 4);
    ink.clip();
    ink.lineJoin = "round";
    for (const [n, curve] of this.curves.entries()) {
      if (!curve.on) continue;
      ink.strokeStyle = curve.colour;
      ink.lineWidth = this.curves.length > 12 ? 1.1 : 1.7;
      ink.setLineDash(curve.dash ? [[], [7, 4], [2, 3]][n % 3] : []);
      ink.beginPath();
      let pen_down = false;
      for (let k = 0; k < time.length; k++) {
        const v = curve.values[k] * this.factor;
        if (!isFinite(v)) { pen_down = false; continue; }
        if (pen_down) ink.lineTo(x(time[k]), y(v)); else ink.moveTo(x(time[k]), y(v));
        pen_down = true;
      }
      ink.stroke();
    }
    ink.restore();
    this.x = x;
  }
  moveTo(t, row) {
    if (this.x) this.cursor.style.transform = `translateX(${this.x(t)}px)`;
    if (row) for (const curve of this.curves) {
      const value = valueAt(curve.values, row) * this.factor;
      curve.shown.textContent = shown(Math.abs(value) <= Math.max(1e-3 * this.noise, 1e-9 * this.most) ? 0 : value);
    }
  }
}
