// The pose explorer: a slider for each coordinate of a joint; the poses follow by forward kinematics, independent of the run.
const sliders = []; // name: of the start value in the FMU; value(row): in the run; in SI units, shown in `unit`
function addSlider(name, label, [unit, factor], [low, high], value) {
  sliders.push({ name, label, unit, factor, low, high, value });
  return sliders.length - 1;
}
const DEGREES = ["deg", 180 / Math.PI];
for (const link of links) {
  const values = link.ball && link.ball.columns;
  if (values) link.sliders = ["z", "x", "y"].map((axis, k) => addSlider(`${link.ball.name}.quaternion0`, `${link.ball.name} about ${axis}`, DEGREES, [-Math.PI, Math.PI], (row) => anglesOf(turnAt(values, row))[k]));
  else if (link.turn || link.slide) {
    const reach = link.turn ? Math.PI : 2 * radius, unit = link.turn ? DEGREES : ["m", 1], start = link.q0;
    link.sliders = [addSlider(link.start_name, link.label || link.name, unit, [link.lower ?? start - reach, link.upper ?? start + reach], (row) => (link.column ? valueAt(link.column, row) : start))];
  }
}
// angles about z, x, y of a rotation, and back; at +-90 deg about x only the sum or the difference of the others is determined
function anglesOf(R) {
  const a = Math.atan2(-R[1], R[4]), c = Math.cos(a), s = Math.sin(a);
  return [a, Math.atan2(R[7], Math.hypot(R[1], R[4])), Math.atan2(c * R[2] + s * R[5], c * R[0] + s * R[3])];
}
function quaternionOf([a, b, c]) {
  const half = (angle, axis) => [Math.cos(angle / 2), ...[0, 1, 2].map((k) => (k === axis ? Math.sin(angle / 2) : 0))];
  return [half(b, 0), half(c, 1)].reduce(([w, x, y, z], [p, q, r, s]) =>
    [w * p - x * q - y * r - z * s, w * q + x * p + y * s - z * r, w * r - x * s + y * p + z * q, w * s + x * r - y * q + z * p], half(a, 2));
}

function pose(on) {
  if (on && !live) play(false);
  document.getElementById("pose").checked = on;
  document.getElementById("joints").hidden = !on;
  if (on) document.getElementById("plots").scrollTop = 0;
  if (live) return; // there the sliders hold the start pose
  posed = on ? sliders.map((slider) => slider.value(rowAt(now))) : null;
  if (on) sliders.forEach((slider, k) => setSlider(slider, posed[k]));
}
function setSlider({ input, low, high }, value) {
  input.min = Math.min(low, value);
  input.max = Math.max(high, value);
  input.value = value;
}
function writeSlider({ output, factor, unit }, value) {
  output.textContent = `${(value * factor).toFixed(unit === "m" ? 3 : 1).replace("-", "−")} ${unit === "deg" ? "°" : unit}`;
}
// What the sliders cannot do right is said: a pose of theirs need not satisfy loops and couplings.
function reportPose(poses) {
  sliders.forEach((slider, k) => writeSlider(slider, posed[k]));
  const gaps = ties.filter((tie) => tie.kind === "loops").map(({ name, ends }) => `${name} ${shown(1000 * long(plus(endOf(ends[0], poses), endOf(ends[1], poses), -1)))} mm`);
  const coupled = (run.drawing.couplings || []).map(({ name }) => name);
  document.getElementById("open").textContent = [
    gaps.length ? `Loops are not closed here; distance of their points: ${gaps.join(", ")}.` : "",
    coupled.length ? `Couplings are not applied here: ${coupled.join(", ")}.` : ""].filter(Boolean).join(" ");
  document.getElementById("command").textContent = gaps.length || coupled.length ? "" : startOf();
}
// the options of the command line for this pose
function startOf() {
  const moved = [], number = (x) => String(Number(x.toPrecision(6)));
  for (const link of links.filter((link) => link.sliders && sliders[link.sliders[0]].name)) {
    const { name } = sliders[link.sliders[0]], values = link.sliders.map((k) => posed[k]);
    if (link.ball) moved.push(...quaternionOf(values).map((x, k) => `${name}[${k + 1}]=${number(x)}`));
    else if (Math.abs(values[0] - link.q0) > 1e-6) moved.push(`${name}=${number(values[0])}`);
  }
  return moved.length ? `--start ${moved.join(" ")}` : "";
}
// Adds a row of a slider to a panel.
function sliderRow(panel, label, moved) {
  const row = document.createElement("label"), name = document.createElement("span");
  const input = Object.assign(document.createElement("input"), { type: "range", step: "any" }), output = document.createElement("output");
  name.textContent = name.title = label;
  input.oninput = () => moved(Number(input.value));
  row.append(name, input, output);
  panel.append(row);
  return { input, output };
}
let movePose = (k, value) => {
  posed[k] = value;
  refresh(false);
};
for (const [k, slider] of sliders.entries())
  Object.assign(slider, sliderRow(document.getElementById("sliders"), slider.label, (value) => movePose(k, value)));
