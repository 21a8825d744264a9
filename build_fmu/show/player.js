// The player: one current time for the view and all plots.
const byId = (id) => document.getElementById(id);
let now = startTime, playing = false, before = 0, lastLegend = 0;

function seek(t, pause = true) {
  now = Math.min(stopTime, Math.max(startTime, t));
  if (pause) play(false);
  if (posed) pose(false);
  refresh(true);
}
function play(on) {
  playing = on && stopTime > startTime;
  byId("play").querySelector("path").setAttribute("d", playing ? "M3 2h4v12H3zM9 2h4v12H9z" : "M4 1.5v13l10-6.5z");
  if (playing) {
    if (posed) pose(false);
    if (now >= stopTime) now = startTime;
    before = 0;
    requestAnimationFrame(step);
  }
}
let advance = (seconds) => {
  now += seconds;
  if (now > stopTime) now = startTime;
};
function step(stamp) {
  if (!playing) return;
  if (before) advance((stamp - before) / 1000 * Number(byId("speed").value));
  before = stamp;
  const legend = stamp - lastLegend > 90;
  if (legend) lastLegend = stamp;
  refresh(legend);
  requestAnimationFrame(step);
}
const digits = Math.min(4, Math.max(2, 2 - Math.floor(Math.log10(stopTime - startTime || 1))));
let clockText = () => `${now.toFixed(digits)} of ${stopTime.toFixed(digits)} s`;
function refresh(legend) {
  paint(now);
  const row = legend ? rowAt(now) : null;
  for (const panel of panels) panel.moveTo(now, row);
  Object.assign(byId("scrub"), { min: startTime, max: stopTime, value: now });
  byId("clock").textContent = clockText();
}
function redraw() {
  for (const panel of panels) panel.draw();
  refresh(true);
}

const panels = run.panels.map((panel) => new Panel(byId("plots"), panel, seek));
if (!links.length) document.querySelector("main").classList.add("plain");
byId("scrub").oninput = (event) => seek(Number(event.target.value));
byId("play").onclick = () => play(!playing);
for (const id of ["names", "frames", "trace", "contacts", "shapes"]) byId(id).onchange = () => refresh(false);
byId("touching").hidden = !contacts.length;
byId("shaped").hidden = !shapes.length;
byId("names").checked = links.length <= 8;
function look(from) {
  view = from;
  refresh(false);
}
for (const from of Object.keys(VIEWS)) byId(from).onclick = () => look(from);
canvas.ondblclick = () => look("home");
byId("pose").parentElement.hidden = !sliders.length;
byId("pose").onchange = () => {
  pose(byId("pose").checked);
  refresh(true);
};
byId("follow").checked = leaves;
byId("follow").onchange = () => look(view || "home");
window.addEventListener("keydown", (event) => {
  if (event.target.matches("select, .legend button, #sliders input, .controls input")) return;
  const small = (stopTime - startTime) / (event.shiftKey ? 20 : 200);
  const actions = { " ": () => play(!playing), ArrowLeft: () => seek(now - small), ArrowRight: () => seek(now + small), Home: () => seek(startTime), End: () => seek(stopTime) };
  if (!actions[event.key] || (event.key === " " && event.target.matches("button, input[type=checkbox]"))) return;
  event.preventDefault();
  actions[event.key]();
});

// rotate, pan and zoom the view with mouse, pen or touch
const fingers = new Map();
let hand = null; // of a live page: holds a link with the mouse
canvas.onpointerdown = (event) => {
  canvas.setPointerCapture(event.pointerId);
  if (hand && !event.shiftKey && event.button === 0 && !fingers.size && hand.take(event)) return;
  fingers.set(event.pointerId, event);
};
canvas.onpointerup = canvas.onpointercancel = (event) => {
  fingers.delete(event.pointerId);
  if (hand) hand.release();
};
canvas.oncontextmenu = (event) => event.preventDefault();
canvas.onpointermove = (event) => {
  if (hand && hand.move(event)) return;
  const last = fingers.get(event.pointerId);
  if (!last) return;
  const dx = event.clientX - last.clientX, dy = event.clientY - last.clientY;
  if (fingers.size === 2) {
    const other = [...fingers].find(([id]) => id !== event.pointerId)[1];
    const apart = (e) => Math.hypot(e.clientX - other.clientX, e.clientY - other.clientY) || 1;
    zoom(apart(last) / apart(event));
  } else if (event.buttons & 2 || event.buttons & 4 || event.shiftKey) {
    const k = camera.far / sight.focus;
    camera.target = plus(plus(camera.target, sight.across, -dx * k), sight.above, dy * k);
  } else {
    camera.yaw -= dx * 0.008;
    camera.pitch = Math.min(1.55, Math.max(-1.55, camera.pitch + dy * 0.008));
  }
  view = null;
  fingers.set(event.pointerId, event);
  if (!playing) refresh(false);
};
function zoom(by) {
  view = null;
  camera.far = Math.min(40 * radius, Math.max(0.15 * radius, camera.far * by));
}
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoom(Math.exp(Math.min(60, Math.max(-60, event.deltaY)) * 0.0025));
  if (!playing) refresh(false);
}, { passive: false });

new ResizeObserver(redraw).observe(byId("plots"));
new ResizeObserver(() => refresh(false)).observe(byId("stage"));
matchMedia("(prefers-color-scheme: dark)").onchange = redraw;
redraw();
// page.html#t=0.5 opens at that time, paused; #pose=0.5,1.2 with these values of the sliders (rad, m); &shadows draws by WebGL
const asked = new URLSearchParams(location.hash.slice(1));
if (asked.has("shadows") && !gpu) byId("shadows").click();
if (live) compute();
else if (asked.has("t")) seek(Number(asked.get("t")));
else if (asked.has("pose") && sliders.length) {
  pose(true);
  asked.get("pose").split(",").slice(0, sliders.length).forEach((text, k) => { sliders[k].input.value = posed[k] = Number(text); });
  refresh(true);
}
else if (matchMedia("(prefers-reduced-motion: reduce)").matches) play(false);
else play(true);
