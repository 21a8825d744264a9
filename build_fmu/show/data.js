// The results: columns by name, stored in the page, in SI units. A live page replaces them while it computes.
const run = JSON.parse(document.getElementById("run").textContent);

function numbers(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Kind(bytes.buffer);
}

const live = run.live; // of a live page: the library, the model and its variables
let time = numbers(run.time, Float64Array);
const columns = new Map();
{
  const all = numbers(run.values, Float32Array);
  run.names.forEach((name, i) => {
    const column = new Float32Array(live ? Math.max(live.rows, time.length) : time.length);
    column.set(all.subarray(i * time.length, (i + 1) * time.length));
    columns.set(name, column);
  });
}
let startTime = time[0], stopTime = time[time.length - 1];

// The rows before and after a time, and the interpolation weight.
function rowAt(t) {
  let low = 0, high = time.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (time[middle] <= t) low = middle; else high = middle;
  }
  const span = time[high] - time[low];
  return [low, high, span > 0 ? Math.min(1, Math.max(0, (t - time[low]) / span)) : 0];
}

function valueAt(column, [low, high, part]) {
  return part === 0 ? column[low] : column[low] + part * (column[high] - column[low]);
}

// Colours: each joint has the same colour in the view and in all plots.
const PALETTE = ["#2f6fb5", "#e07b39", "#3a9d5d", "#c8455a", "#8064b8", "#a5734d", "#d46fae", "#6d7f8c", "#a8a32e", "#2ba5b5"];
function colourOf(index, count) {
  return count <= PALETTE.length ? PALETTE[index % PALETTE.length] : `hsl(${Math.round(250 - 250 * index / (count - 1))} 62% 50%)`;
}
function css(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
function tick(option) {
  return document.getElementById(option).checked;
}
