// Paints a frame of the view: floor, shadow, links, joints, centres of mass, loops, springs, contacts, names, traces.

function niceStep(x) {
  const power = 10 ** Math.floor(Math.log10(x));
  return [1, 2, 5, 10].map((k) => k * power).find((step) => step >= x * 0.999);
}

// the floor is below a spatial mechanism, or behind a planar one; a contact with the ground replaces the one below
const lowest = extents.run.points.reduce((least, point) => Math.min(least, dot(point, up)), 0);
const level = grounds.find((shape) => shape.kind === "plane" && dot(axisOf(shape), up) > 0.5);
const floorNormal = normal || (level ? axisOf(level) : up);
const floorHeight = normal ? dot(middle, normal) - 3 * thick : level ? dot(level.p, floorNormal) : lowest - (lowest < -1e-9 ? 2 * thick : 0);
const hasFloor = normal || level || !grounds.length;
const floorStep = niceStep(radius / 5);
function axisOf({ R }) {
  return [R[2], R[5], R[8]];
}
function onFloor(point) {
  return plus(point, floorNormal, floorHeight - dot(point, floorNormal));
}

const SUN = unit(plus(plus(scaled(floorNormal, 1.6), right, -0.55), normal ? up : front, 0.75));

function paintFloor(poses) {
  if (hasFloor) paintGrid(floorNormal, floorHeight);
  for (const shape of terrains)
    if (shape.kind === "plane" && (normal || shape !== level)) {
      const pose = shapePose(shape, poses), facing = axisOf(pose);
      paintGrid(facing, dot(pose.p, facing));
    }
}
let travelled = [0, 0, 0]; // of the mechanism that the view follows
function centreOfView() {
  return plus(extentInView().middle, travelled);
}
// A grid on the plane with this unit normal and distance from the origin, around the mechanism.
function paintGrid(facing, height) {
  const across = without(right, facing), floorU = long(across) > 0.1 ? unit(across) : unit(without(up, facing)), floorV = cross(facing, floorU);
  const centre = centreOfView(), cu = dot(centre, floorU), cv = dot(centre, floorV), reach = 2.2 * extentInView().radius;
  const base = scaled(facing, height);
  if (gpu) {
    gpu.floor(plus(plus(base, floorU, cu), floorV, cv), floorU, floorV, reach);
    return;
  }
  const at = (u, v) => project(plus(plus(base, floorU, u), floorV, v));
  pen.lineWidth = 1;
  const first = (x) => Math.ceil((x - reach) / floorStep), last = (x) => Math.floor((x + reach) / floorStep);
  const stroke = (points) => {
    for (let i = 1; i < points.length; i++) {
      const [a, b] = [points[i - 1], points[i]];
      if (a[2] < 0.05 * radius || b[2] < 0.05 * radius) continue;
      // the grid fades towards its border
      const away = Math.min(1, Math.max(a.away, b.away));
      pen.globalAlpha = Math.max(0, 1 - away * away);
      pen.beginPath();
      pen.moveTo(a[0], a[1]);
      pen.lineTo(b[0], b[1]);
      pen.stroke();
    }
    pen.globalAlpha = 1;
  };
  pen.strokeStyle = css("--floor");
  for (const lengthwise of [true, false]) {
    for (let k = first(lengthwise ? cv : cu); k <= last(lengthwise ? cv : cu); k++) {
      const points = [];
      for (let n = 0; n <= 24; n++) {
        const s = (lengthwise ? cu : cv) - reach + 2 * reach * n / 24;
        const [u, v] = lengthwise ? [s, k * floorStep] : [k * floorStep, s];
        const q = at(u, v);
        q.away = Math.hypot(u - cu, v - cv) / reach;
        points.push(q);
      }
      stroke(points);
    }
  }
}

const shade = document.createElement("canvas");
function paintShadow(poses) {
  // drawn on a separate canvas, so that overlaps are not darker
  shade.width = canvas.width;
  shade.height = canvas.height;
  const ink = shade.getContext("2d");
  ink.setTransform(pen.getTransform());
  ink.strokeStyle = `rgb(${css("--shadow")})`;
  ink.lineCap = "round";
  for (const [a, b, , width] of bonesOf(poses)) {
    const p = project(onFloor(a)), q = project(onFloor(b));
    if (Math.min(p[2], q[2]) < 0.05 * radius) continue;
    ink.lineWidth = 2.2 * width * thick * (p[3] + q[3]) / 2;
    ink.beginPath();
    ink.moveTo(p[0], p[1]);
    ink.lineTo(q[0], q[1]);
    ink.stroke();
  }
  shadeShapes(ink, poses);
  pen.globalAlpha = normal ? 0.1 : 0.17;
  pen.drawImage(shade, 0, 0, canvas.clientWidth, canvas.clientHeight);
  pen.globalAlpha = 1;
}

// the contact shape at the end of an end link, which extends to it
const footOf = links.map((link, i) => tips.includes(i) && !link.floats && solids.find((shape) => shape.link === i && long(shape.p) > 1e-9));
// the rods of the links: [from, to, colour, width, link]
function bonesOf(poses) {
  const rods = [];
  links.forEach((link, i) => {
    const base = link.parent < 0 ? [0, 0, 0] : poses[link.parent].p;
    const colour = link.parent < 0 ? css("--metal") : links[link.parent].colour;
    if (!link.floats && !isShaped(link.parent) && long(plus(poses[i].p, base, -1)) > 1e-9) rods.push([base, poses[i].p, colour, link.parent < 0 ? 0.55 : 1, link.parent]);
    const isTip = tips.includes(i), centre = place(poses[i], link.centre);
    if (link.mass > 0 && !isShaped(i) && long(link.centre) > 1e-9) {
      const held = footOf[i] || ties.some((tie) => tie.kind === "loops" && tie.ends.some((end) => end.link === i));
      rods.push([poses[i].p, centre, link.colour, isTip && !held ? 1 : 0.35, i]);
    }
  });
  footOf.forEach((shape, i) => shape && !isShaped(i) && rods.push([poses[i].p, shapePose(shape, poses).p, links[i].colour, 1, i]));
  for (const tie of ties)
    for (const end of tie.ends)
      if (end.link >= 0 && !isShaped(end.link) && tie.kind === "loops") rods.push([poses[end.link].p, endOf(end, poses), links[end.link].colour, 1, end.link]);
  return rods;
}

function paintLinks(poses) {
  for (const [a, b, colour, width] of bonesOf(poses)) tube(a, b, width * thick, width * thick * (width === 1 ? 0.82 : 1), colour);
  links.forEach((link, i) => {
    const { R, p } = poses[i], axis = [R[2], R[5], R[8]];
    if (isShaped(i)) return;
    if (link.mass > 0 && links.length <= 60) massCentre(place(poses[i], link.centre), thick * (0.55 + 0.75 * Math.cbrt(link.mass / (totalMass || 1))));
    if (link.floats || isShaped(link.parent)) return;
    if (link.type === "spherical") ball(p, 1.6 * thick, link.colour);
    if (link.parent < 0 && link.type !== "fixed") tube(plus(p, axis, -1.15 * thick), plus(p, axis, 1.15 * thick), 1.75 * thick, 1.75 * thick, css("--metal"));
    if (link.turn) tube(plus(p, axis, -1.7 * thick), plus(p, axis, 1.7 * thick), 1.28 * thick, 1.28 * thick, link.colour);
    if (link.slide) {
      if (!link.turn) box(p, R, [1.5 * thick, 1.5 * thick, 2.1 * thick], link.colour);
      tube(plus(p, axis, -4.5 * thick), plus(p, axis, 4.5 * thick), 0.35 * thick, 0.35 * thick, css("--metal"));
    }
    // two bright studs at the ends of a joint axis
    if (link.turn) tube(plus(p, axis, -2 * thick), plus(p, axis, 2 * thick), 0.5 * thick, 0.5 * thick, "#dfe6ec");
  });
  for (const tie of ties) {
    const [a, b] = tie.ends.map((end) => endOf(end, poses));
    const colour = tie.kind === "bushings" ? "#2e8b57" : "#8e44ad";
    if (tie.kind === "springs") coil(a, b);
    else {
      ball(a, 1.15 * thick, colour);
      if (long(plus(a, b, -1)) > 0.3 * thick) {
        ball(b, 1.15 * thick, colour);
        polyline([a, b], colour, 1.5);
      }
    }
  }
}

const AXES = ["#d1495b", "#3a9d5d", "#2f6fb5"];
function paintAxes(pose, length, width) {
  AXES.forEach((colour, k) => {
    const tip = plus(pose.p, [pose.R[k], pose.R[3 + k], pose.R[6 + k]], length);
    polyline([pose.p, tip], colour, width);
    if (pose === IDENTITY) label(tip, "xyz"[k], colour, 4);
  });
}
let labels = [];
function label(point, text, colour, shift = 9) {
  const q = project(point);
  if (q[2] > 0.02 * radius) labels.push([q[0] + shift, q[1] - shift, text, colour]);
}
// joints at the same point, such as a wrist, share one label
function paintNames(poses) {
  const spots = [];
  links.forEach((link, i) => {
    if (link.floats && link.slide) return;
    const q = project(poses[i].p);
    const spot = spots.find((other) => Math.hypot(other.q[0] - q[0], other.q[1] - q[1]) < 18);
    // joints with several DOF, hand[1] and hand[2], have the name of their link
    const name = link.name.split("[")[0];
    if (spot && spot.names.includes(name)) return;
    if (spot) spot.names.push(name); else spots.push({ q, p: poses[i].p, names: [name] });
  });
  for (const { p, names } of spots) label(p, names.length < 4 ? names.join(", ") : `${names[0]} … ${names[names.length - 1]}`, css("--ink"), 12);
}
function paintLabels() {
  pen.font = "12px system-ui, 'DejaVu Sans', sans-serif";
  pen.lineJoin = "round";
  for (const [x, y, text, colour] of labels) {
    pen.strokeStyle = css("--sky");
    pen.lineWidth = 4;
    pen.strokeText(text, x, y);
    pen.fillStyle = colour;
    pen.fillText(text, x, y);
  }
}
function paintTraces(t) {
  const window_ = Math.max((stopTime - startTime) / 4, 1e-9);
  traces.forEach((points, n) => {
    const colour = links[traced[n]].colour;
    let last = null;
    for (const point of points) {
      const age = (t - point.t) / window_;
      if (age < 0) break;
      if (age > 1) continue;
      const b = project(point.p), a = last && last.flat;
      if (a && Math.hypot(b[0] - a[0], b[1] - a[1]) < 2.5) continue; // px
      if (a) traceLine(last.p, point.p, a, b, colour, 0.75 * (1 - age));
      last = { p: point.p, flat: b };
    }
  });
}
function traceLine(from, to, a, b, colour, opacity) {
  if (gpu) {
    gpu.ribbon(from, to, 3.6 / (a[3] + b[3]), colour, opacity);
    return;
  }
  pen.strokeStyle = colour;
  pen.lineWidth = 1.8;
  pen.globalAlpha = opacity;
  pen.beginPath();
  pen.moveTo(a[0], a[1]);
  pen.lineTo(b[0], b[1]);
  pen.stroke();
  pen.globalAlpha = 1;
}

function paint(t) {
  const scale = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height || !links.length) return;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.lineCap = pen.lineJoin = "round";
  const row = rowAt(t), poses = posesAt(row);
  travelled = tick("follow") ? travelOf(poses) : [0, 0, 0];
  if (view) fit(width, height, posed && pointsOf(poses).map((point) => plus(point, travelled, -1)));
  aim(width, height, travelled);
  parts = [];
  labels = [];
  if (gpu) gpu.begin(canvas.width, canvas.height);
  paintFloor(poses);
  if (hasFloor && !gpu) paintShadow(poses);
  if (tick("trace") && !posed) paintTraces(t);
  paintLinks(poses);
  if (!gpu) paintShapes(poses);
  if (tick("contacts")) paintContacts(poses, row);
  if (hand) hand.paint(poses);
  paintAxes(IDENTITY, 0.2 * radius, 2);
  if (tick("frames")) poses.forEach((pose) => paintAxes(pose, 5 * thick, 2));
  if (tick("names")) paintNames(poses);
  if (gpu) gpu.end(placedShapes(poses), SUN, centreOfView(), LIT * extentInView().radius);
  parts.sort((a, b) => b[0] - a[0]);
  for (const [, draw] of parts) draw();
  paintLabels();
  if (posed) reportPose(poses);
  // what a test reads: where the ends of the mechanism are
  document.documentElement.dataset.tips = JSON.stringify(tips.map((i) => tipOf(i, poses)));
  document.documentElement.dataset.shapes = JSON.stringify(contacts.map(({ shapes }) => shapePose(shapes[0], poses).p));
  document.documentElement.dataset.solids = JSON.stringify(shapes.map(({ link, corners }) => place(link < 0 ? IDENTITY : poses[link], corners[0])));
  document.documentElement.dataset.forces = JSON.stringify(forcesAt(row));
  document.documentElement.dataset.floor = JSON.stringify(hasFloor ? [...floorNormal, floorHeight] : []);
  document.documentElement.dataset.extent = JSON.stringify([extents.run.radius, extents.robot.radius, leaves, travelled]);
  document.documentElement.dataset.up = JSON.stringify(up);
  document.documentElement.dataset.faces = gpu ? gpu.stores.opaque.used / STRIDE : parts.length;
  document.documentElement.dataset.drawn = gpu ? "WebGL" : "canvas";
}
