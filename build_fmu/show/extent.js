// What the view must contain: the mechanism in the whole run, or around its moving center of mass.

// A planar mechanism is viewed along its axes, others from the side and above.
const normal = [[0, 0, 1], [0, -1, 0], [1, 0, 0]].find((n) => moving.length && moving.every((link) => {
  const along = Math.abs(dot(n, [link.start.R[2], link.start.R[5], link.start.R[8]]));
  return (link.turn || link.slide) && (!link.turn || along > 1 - 1e-9) && (!link.slide || along < 1e-9);
}));
// Up is opposite to gravity, projected onto the plane of motion; without gravity z is up, or y in the x-y plane.
function without(v, n) {
  return plus(v, n, -dot(v, n));
}
const gravity = run.drawing.gravity || [0, 0, 0];
const against = scaled(normal ? without(gravity, normal) : gravity, -1);
const up = long(against) > 1e-6 * long(gravity) && long(gravity) > 0 ? unit(against) : normal && normal[2] ? [0, 1, 0] : [0, 0, 1];
const right = normal ? cross(up, normal) : unit(without(Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], up));
const front = cross(right, up);

// the corners of a box around each shape, in the frame of its link
const boxes = (run.drawing.solids || []).map(({ link, points }) => {
  const bounds = [0, 1, 2].map(() => [Infinity, -Infinity]);
  numbers(points, Float32Array).forEach((x, i) => {
    const side = bounds[i % 3];
    side[0] = Math.min(side[0], x);
    side[1] = Math.max(side[1], x);
  });
  return { link, box: bounds[0].flatMap((x) => bounds[1].flatMap((y) => bounds[2].map((z) => [x, y, z]))) };
});

// the end links, whose paths are traced
const tips = links.map((link, i) => i).filter((i) => links.every((other) => other.parent !== i));
function tipOf(i, poses) {
  const link = links[i];
  return long(link.centre) > 1e-9 && link.mass > 0 ? place(poses[i], link.centre) : poses[i].p;
}
const traced = tips.slice(0, 4);
const traces = traced.map(() => []);

const totalMass = links.reduce((sum, link) => sum + link.mass, 0);
function centreOf(poses) {
  return links.reduce((sum, link, i) => plus(sum, totalMass ? place(poses[i], link.centre) : poses[i].p, totalMass ? link.mass / totalMass : 1 / links.length), [0, 0, 0]);
}
const grounds = terrains.filter((shape) => shape.link < 0);
const startCentre = links.length ? centreOf(posesAt(rowAt(startTime))) : [0, 0, 0];
// how far a view that follows the mechanism has moved; above a ground it moves in the horizontal plane
function travelOf(poses) {
  const moved = plus(centreOf(poses), startCentre, -1);
  return grounds.length ? without(moved, up) : moved;
}

// directions in which the outermost points are kept
const WAYS = [up, scaled(up, -1)];
for (let x = -2; x <= 2; x++)
  for (let y = -2; y <= 2; y++)
    for (let z = -2; z <= 2; z++) if (Math.max(Math.abs(x), Math.abs(y), Math.abs(z)) === 2) WAYS.push([x, y, z]);

class Extent {
  constructor() {
    this.outermost = WAYS.map(() => [-Infinity, [0, 0, 0]]);
    this.low = [Infinity, Infinity, Infinity];
    this.high = [-Infinity, -Infinity, -Infinity];
  }
  include(point) {
    for (let k = 0; k < 3; k++) {
      this.low[k] = Math.min(this.low[k], point[k]);
      this.high[k] = Math.max(this.high[k], point[k]);
    }
    for (let i = 0; i < WAYS.length; i++) {
      const far = dot(WAYS[i], point);
      if (far > this.outermost[i][0]) this.outermost[i] = [far, point];
    }
  }
  get points() {
    return [...new Set(this.outermost.map(([, point]) => point))];
  }
  get middle() {
    return [0, 1, 2].map((k) => (this.low[k] + this.high[k]) / 2);
  }
  get radius() {
    return Math.max(1e-9, long(plus(this.high, this.low, -1)) / 2);
  }
}
const floats = links.some((link) => link.floats);
const extents = { run: new Extent(), robot: new Extent() };
const places = posesAt(rowAt(startTime)).map((pose) => pose.p); // of the links that stay there
if (links.length) {
  // the ground frame is part of the picture, but a floating base leaves it
  extents.run.include([0, 0, 0]);
  if (!floats) extents.robot.include([0, 0, 0]);
  // also between rows, for smooth traces
  const count = Math.min(3000, Math.max(400, time.length)), every = Math.ceil(count * links.length / 4000);
  for (let k = 0; k <= count; k++) {
    const t = startTime + (stopTime - startTime) * k / count, poses = posesAt(rowAt(t));
    trace(t, poses);
    if (k % every) continue;
    poses.forEach((pose, i) => { if (long(plus(pose.p, places[i], -1)) > 1e-9 * extents.run.radius) places[i] = [NaN, NaN, NaN]; });
    contain(poses);
  }
}
function trace(t, poses) {
  traced.forEach((i, n) => traces[n].push({ t, p: tipOf(i, poses) }));
}
function contain(poses) {
  const travelled = travelOf(poses);
  for (const point of pointsOf(poses)) {
    extents.run.include(point);
    extents.robot.include(plus(point, travelled, -1));
  }
}
function pointsOf(poses) {
  const points = [];
  poses.forEach((pose, i) => {
    if (!(links[i].floats && links[i].slide)) points.push(pose.p);
    if (links[i].mass > 0) points.push(place(pose, links[i].centre));
  });
  for (const tie of ties) for (const end of tie.ends) points.push(endOf(end, poses));
  for (const { link, box } of boxes) for (const corner of box) points.push(place(link < 0 ? IDENTITY : poses[link], corner));
  for (const shape of contacts.flatMap((contact) => contact.shapes)) {
    const pose = shapePose(shape, poses);
    for (const point of hull(shape)) points.push(place(pose, point));
  }
  return points;
}
// a mechanism that leaves its place is followed, unless a joint holds it
const held = links.some((link, i) => link.type !== "fixed" && !link.floats && !isNaN(places[i][0]));
const leaves = !held && extents.run.radius > 1.5 * extents.robot.radius;
const { radius, middle } = extents[leaves ? "robot" : "run"];
// what the view contains: the mechanism that it follows, or the run
function extentInView() {
  return extents[tick("follow") ? "robot" : "run"];
}
