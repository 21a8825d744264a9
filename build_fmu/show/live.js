// The live page: the library runs the model, sliders and mouse act on it, and the results replace those of the page.
const SPAN = 10 * Math.min(1, stopTime - startTime || 1); // s of simulated time in the plots
const BUDGET = 20; // ms that a frame may compute; more if frames take long, up to half of the time
const FINE = 2e-3; // s, of a communication step while the mouse pulls
const STIFF = 10; // rad/s, of the pull on the mass that the held link carries, at least a tenth of all

async function inflated(text) {
  const packed = new Blob([numbers(text, Uint8Array)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(packed).arrayBuffer());
}

class Computation {
  constructor(core) {
    this.core = core;
    this.clock = new Float64Array(live.rows);
    this.outputs = core.list(run.names.map((name) => live.references[name]));
    this.set = new Map(live.start.map(([reference, value]) => [reference, value])); // what differs from the model file
    this.values = run.names.map((name) => columns.get(name));
    const rowOf = new Map(run.names.map((name, i) => [live.references[name], i]));
    this.motions = live.motions.map((references) => ({ references, list: core.list(references), rows: references.map((r) => rowOf.get(r)) }));
  }
  // Starts anew with all values that the user has set.
  restart() {
    const { core } = this;
    core.reset();
    if (this.set.size) core.write(core.list([...this.set.keys()]), [...this.set.values()]);
    core.initialise(live.from);
    for (const motion of this.motions) motion.parts = [...core.read(motion.list)];
    this.time = live.from;
    this.rows = this.late = this.began = 0;
    for (const points of traces) points.length = 0;
    this.record();
  }
  change(reference, value) {
    this.set.set(reference, value);
    const list = this.core.list([reference]);
    const same = this.core.read(list)[0] === value; // has no effect
    this.core.write(list, [value]);
    if (same) return;
    for (const { references, parts } of this.motions) if (references.includes(reference)) parts[references.indexOf(reference)] = value;
  }
  // A prescribed motion continues from the values set last, which are all that the library returns.
  follow(size) {
    for (const motion of this.motions) {
      const [q, qd, qdd] = motion.parts;
      motion.parts = [q + (qd + qdd * size / 2) * size, qd + qdd * size, qdd];
    }
  }
  // Adds the current values as a row, or replaces the last one if that is very near.
  record() {
    const { clock, values } = this, near = this.rows > 1 && this.time - clock[this.rows - 2] < SPAN / 600;
    if (this.rows === clock.length) {
      const half = this.rows >> 1;
      for (const column of [clock, ...values]) column.copyWithin(0, half, this.rows);
      this.rows -= half;
    }
    const row = near ? this.rows - 1 : this.rows++;
    clock[row] = this.time;
    this.core.read(this.outputs).forEach((value, i) => { values[i][row] = value; });
    for (const { rows, parts } of this.motions) rows.forEach((i, k) => { if (i !== undefined) values[i][row] = parts[k]; });
    time = clock.subarray(0, this.rows);
    startTime = Math.max(time[0], this.time - SPAN);
    stopTime = Math.max(this.time, startTime + SPAN);
    if (!near) trace(this.time, posesAt(last()));
  }
  // Computes so many seconds; what takes too long is left out.
  advance(seconds) {
    const began = performance.now(), limit = began + Math.max(BUDGET, Math.min(10 * BUDGET, (began - this.began) / 2)), fresh = this.rows;
    this.began = began;
    this.late += seconds;
    while (performance.now() < limit) {
      const size = grip ? Math.min(FINE, live.step) : live.step;
      if (this.late < size) break;
      if (grip) this.pull(size);
      this.core.step(this.time, size);
      this.follow(size);
      this.time += size;
      this.late -= size;
      if (grip || this.time - this.clock[this.rows - 1] >= SPAN / 600) this.record();
    }
    if (this.late > live.step) this.late = 0;
    this.record();
    if (this.rows !== fresh) keepInView();
  }
  // The force of the mouse on the held link: a spring and a damper from the held point to the mouse. It is the force at the end of the step,
  // (1 + (k h² + c h) W) F = k (goal - x) - (k h + c) (v + a h), where a + W F is the acceleration of the point: stable for links without mass.
  pull(size) {
    const { core } = this, [pose, at] = heldPoint(), arm = plus(at, pose.p, -1);
    const ofPoint = (list) => {
      const [x, y, z, ...turn] = core.read(list);
      return plus([x, y, z], cross(turn, arm));
    };
    const use = (force) => core.write(grip.wrench, [...force, ...cross(arm, force)]);
    const accelerated = (force) => {
      use(force);
      return ofPoint(grip.accelerations);
    };
    const probe = grip.mass * STIFF, free = accelerated([0, 0, 0]);
    const mobility = [0, 1, 2].map((k) => scaled(plus(accelerated([0, 1, 2].map((i) => (i === k ? probe : 0))), free, -1), 1 / probe));
    const stiffness = grip.mass * STIFF ** 2, damping = 1.4 * grip.mass * STIFF;
    const matrix = mobility.map((column, k) => column.map((x, i) => (i === k ? 1 : 0) + (stiffness * size * size + damping * size) * x));
    const speed = plus(ofPoint(grip.speeds), free, size);
    const right = plus(scaled(plus(grip.goal, at, -1), stiffness), speed, -(stiffness * size + damping));
    grip.force = solved(matrix, right);
    use(grip.force);
  }
}
// The solution of three equations, by columns.
function solved([a, b, c], right) {
  const whole = dot(a, cross(b, c));
  return [dot(right, cross(b, c)) / whole, dot(a, cross(right, c)) / whole, dot(a, cross(b, right)) / whole];
}
function last() {
  return [time.length - 1, time.length - 1, 0];
}
function keepInView() {
  for (const points of traces) if (points.length > 2 * live.rows) points.splice(0, live.rows);
  if (view && extents.run.radius < 4 * radius) contain(posesAt(last())); // not what flies away
}

let computation = null, grip = null;
function heldPoint() {
  const pose = posesAt(last())[grip.link];
  return [pose, place(pose, grip.point)];
}
// The mass that a link carries outboard.
function carried(i) {
  return links.reduce((sum, link, k) => {
    let above = k;
    while (above >= 0 && above !== i) above = links[above].parent;
    return sum + (above === i ? link.mass : 0);
  }, 0);
}

// The link under a point of the canvas, and the distance of the point from the eye along the view.
function pick(x, y) {
  const poses = posesAt(last());
  let best = null;
  const offer = (link, depth) => { if (link >= 0 && live.ports[links[link].name] && !(best && best.depth <= depth)) best = { link, depth }; };
  for (const { shape, pose } of placedShapes(poses)) {
    const flat = shape.corners.map((corner) => project(place(pose, corner)));
    for (const { a, b, c } of shape.faces) if (inside(x, y, flat[a], flat[b], flat[c])) offer(shape.link, (flat[a][2] + flat[b][2] + flat[c][2]) / 3);
  }
  for (const [from, to, , width, link] of bonesOf(poses)) {
    const a = project(from), b = project(to), [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    const part = Math.max(0, Math.min(1, ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy || 1)));
    if (Math.hypot(a[0] + part * dx - x, a[1] + part * dy - y) < 5 + width * thick * a[3]) offer(link, a[2] + part * (b[2] - a[2]));
  }
  for (const shape of solids) {
    const pose = shapePose(shape, poses), q = project(pose.p);
    if (Math.hypot(q[0] - x, q[1] - y) < 5 + q[3] * Math.min(...hull(shape).map(long)) * 0.8) offer(shape.link, q[2]);
  }
  links.forEach((link, i) => {
    const q = project(place(poses[i], link.centre));
    if (link.mass > 0 && Math.hypot(q[0] - x, q[1] - y) < 8) offer(i, q[2]);
  });
  return best;
}
function inside(x, y, a, b, c) {
  const side = (p, q) => (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]), s = [side(a, b), side(b, c), side(c, a)];
  return s.every((k) => k >= 0) || s.every((k) => k <= 0);
}
// the point at a place of the canvas, at a distance along the view
function unprojected(x, y, depth) {
  const k = depth / sight.focus;
  return plus(plus(plus(eye, sight.back, -depth), sight.across, k * (x - sight.width / 2)), sight.above, -k * (y - sight.height / 2));
}

const pointer = {
  take({ offsetX, offsetY }) {
    const found = now === computation.time && pick(offsetX, offsetY);
    if (!found) return false;
    const goal = unprojected(offsetX, offsetY, found.depth), pose = posesAt(last())[found.link], port = live.ports[links[found.link].name];
    const lists = Object.fromEntries(Object.entries(port).map(([name, references]) => [name, computation.core.list(references)]));
    grip = { ...found, ...lists, goal, point: seen(pose, goal), force: [0, 0, 0], mass: Math.max(carried(found.link), totalMass / 10) };
    if (!playing) play(true);
    return true;
  },
  move({ offsetX, offsetY }) {
    if (grip) grip.goal = unprojected(offsetX, offsetY, grip.depth);
    return Boolean(grip);
  },
  release() {
    if (!grip) return;
    guarded(() => computation.core.write(grip.wrench, [0, 0, 0, 0, 0, 0]));
    grip = null;
  },
  paint() {
    if (!grip) return;
    const [, at] = heldPoint(), size = long(grip.force);
    polyline([at, grip.goal], FORCE, 1.5);
    if (size > 0) paintForce(at, grip.force, Math.min(0.9 * radius, 0.4 * radius * size / (grip.mass * STIFF ** 2 * 0.4 * radius)));
    label(at, `${shown(size)} N`, css("--ink"), 14);
  },
};

// Shows a failure; the computation then needs a new start.
function guarded(work) {
  try {
    work();
    return true;
  } catch (error) {
    play(false);
    byId("trouble").hidden = false;
    byId("trouble").textContent = error.message;
    document.documentElement.dataset.failure = error.message;
    return false;
  }
}
function restart() {
  byId("trouble").hidden = true;
  grip = null;
  guarded(() => computation.restart());
  now = startTime;
  redraw();
}

// Sliders for inputs and tunable parameters, with a field for other values.
function controlPanel(title, kind) {
  const chosen = live.controls.filter((control) => control.kind === kind);
  if (!chosen.length) return;
  const panel = document.createElement("article"), heading = document.createElement("h2");
  panel.className = "panel controls";
  heading.textContent = title;
  panel.append(heading);
  byId("plots").prepend(panel);
  for (const { name, reference, unit, factor, low, high, value } of chosen) {
    const field = Object.assign(document.createElement("input"), { type: "number", step: "any" });
    const use = (x) => {
      field.value = Number((x * factor).toPrecision(5));
      guarded(() => computation.change(reference, x));
    };
    const { input, output } = sliderRow(panel, unit ? `${name} in ${unit}` : name, use);
    Object.assign(input, { min: low, max: high });
    Object.assign(input, { value });
    field.value = Number((value * factor).toPrecision(5));
    field.setAttribute("aria-label", name);
    field.onchange = () => {
      const x = Number(field.value) / factor;
      Object.assign(input, { min: Math.min(input.min, x), max: Math.max(input.max, x) });
      input.value = x;
      use(x);
    };
    input.ondblclick = () => {
      input.value = value;
      use(value);
    };
    output.replaceWith(field);
  }
}
// The sliders of the pose explorer set the start pose here; the library closes the loops.
function startSliders() {
  byId("joints").querySelector("small").textContent = "the motion starts anew when a slider moves";
  const pose0 = sliders.map((slider) => slider.value([0, 0, 0]));
  const referencesOf = (link) => {
    const name = sliders[link.sliders[0]].name;
    return (link.ball ? [1, 2, 3, 4].map((k) => `${name}[${k}]`) : [name]).map((variable) => live.references[variable]);
  };
  for (const link of links.filter((other) => other.sliders)) {
    const fixed = referencesOf(link).some((reference) => reference === undefined);
    for (const k of link.sliders) {
      setSlider(sliders[k], pose0[k]);
      writeSlider(sliders[k], pose0[k]);
      sliders[k].input.parentElement.hidden = fixed;
      sliders[k].link = link;
    }
  }
  movePose = (k, value) => {
    const { link } = sliders[k];
    pose0[k] = value;
    writeSlider(sliders[k], value);
    const values = link.ball ? quaternionOf(link.sliders.map((other) => pose0[other])) : [value];
    referencesOf(link).forEach((reference, i) => computation.set.set(reference, values[i]));
    play(false);
    restart();
  };
}

async function compute() {
  const files = Object.fromEntries(Object.entries(live.files).map(([name, text]) => [name, numbers(text, Uint8Array)]));
  try {
    computation = new Computation(await Core.load(await inflated(live.core), files, live.guid));
  } catch (error) {
    guarded(() => { throw error; });
    return;
  }
  controlPanel("Parameters", "parameter");
  controlPanel("Inputs", "input");
  startSliders();
  hand = pointer;
  byId("licences").hidden = false;
  byId("licences").onclick = async () => {
    byId("terms").firstElementChild.textContent = new TextDecoder().decode(await inflated(live.licences));
    byId("terms").showModal();
  };
  byId("reset").hidden = false;
  byId("reset").onclick = restart;
  byId("hint").textContent = "drag a link: push it · drag elsewhere: rotate · wheel: zoom · right button: pan";
  let turn = 0, since = 0, simulated = 0, passed = 0, rate = 0;
  clockText = () => `${now.toFixed(digits)} s, ${rate.toFixed(2)}×`;
  advance = (seconds) => {
    const from = computation.time, began = performance.now();
    if (began - computation.began > 500) [since, simulated, passed] = [began, 0, 0]; // after a pause
    if (!guarded(() => computation.advance(seconds))) return;
    now = computation.time;
    if (panels.length) panels[turn++ % panels.length].draw();
    // of the last second: simulated time over elapsed time, and the part of it that was spent in the library
    simulated += now - from;
    passed += performance.now() - began;
    if (began - since < 1000) return;
    rate = 1000 * simulated / (began - since);
    Object.assign(document.documentElement.dataset, { rate, load: passed / (began - since), time: now });
    [since, simulated, passed] = [began, 0, 0];
  };
  restart();
  document.documentElement.dataset.live = "ready";
  if (!asked.has("paused")) play(true);
}
