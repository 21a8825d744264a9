// Link poses from the initial poses and the joint displacements (z of a link is the joint axis).
const IDENTITY = { R: [1, 0, 0, 0, 1, 0, 0, 0, 1], p: [0, 0, 0] };

function times(A, B) {
  const C = new Array(9);
  for (let i = 0; i < 9; i += 3)
    for (let j = 0; j < 3; j++) C[i + j] = A[i] * B[j] + A[i + 1] * B[j + 3] + A[i + 2] * B[j + 6];
  return C;
}
function turned(A, v) {
  return [A[0] * v[0] + A[1] * v[1] + A[2] * v[2], A[3] * v[0] + A[4] * v[1] + A[5] * v[2], A[6] * v[0] + A[7] * v[1] + A[8] * v[2]];
}
function transposed(A) {
  return [A[0], A[3], A[6], A[1], A[4], A[7], A[2], A[5], A[8]];
}
function plus(a, b, k = 1) {
  return [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]];
}
function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}
function scaled(a, k) {
  return [a[0] * k, a[1] * k, a[2] * k];
}
function long(a) {
  return Math.hypot(a[0], a[1], a[2]);
}
function unit(a) {
  return scaled(a, 1 / (long(a) || 1));
}
function place(pose, point) {
  return plus(pose.p, turned(pose.R, point));
}
// a point of the ground frame in the frame of a pose
function seen(pose, point) {
  return turned(transposed(pose.R), plus(point, pose.p, -1));
}

const links = run.drawing.links.map((link) => ({ ...link, start: { R: link.rotation.flat(), p: link.origin } }));
for (const ball of run.drawing.balls || []) {
  links[ball.link].ball = { name: ball.name, base: ball.base, columns: ball.columns.map((name) => columns.get(name)), start: matrixOf(ball.quaternion) };
}
// the translations of a floating base, and its rotation: no rods or joints are drawn
for (const link of links) {
  const slides = [1, 2, 3].map((k) => links.find((other) => other.name === `${link.name}[${k}]` && other.slide));
  if (link.type === "spherical" && slides.every(Boolean)) for (const part of [link, ...slides]) part.floats = true;
}
function matrixOf(quaternion) {
  const size = Math.hypot(...quaternion) || 1, [w, x, y, z] = quaternion.map((part) => part / size);
  return [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z), 1 - 2 * (x * x + z * z),
    2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)];
}
// interpolation along the shorter way: q and -q are the same rotation
function turnAt(parts, [from, to, part]) {
  const a = parts.map((column) => column[from]), b = parts.map((column) => column[to]);
  const side = a.reduce((sum, x, k) => sum + x * b[k], 0) < 0 ? -1 : 1;
  return matrixOf(a.map((x, k) => x + part * (side * b[k] - x)));
}
const moving = links.filter((link) => link.type !== "fixed");
for (const link of links) {
  const base = link.parent < 0 ? IDENTITY : links[link.parent].start;
  link.R = times(transposed(base.R), link.start.R);
  link.p = seen(base, link.start.p);
  link.centre = seen(link.start, link.com);
  link.column = columns.get(link.q);
  if (link.ball) {
    // the joint frame relative to its base, without the initial rotation
    const from = link.ball.base < 0 ? IDENTITY : links[link.ball.base].start;
    link.ball.R = times(times(transposed(from.R), link.start.R), transposed(link.ball.start));
    link.ball.p = seen(from, link.start.p);
  }
  link.colour = link.type === "fixed" ? (link.parent < 0 ? "#8b97a3" : links[link.parent].colour) : colourOf(moving.indexOf(link), moving.length);
}
function carrier(name) {
  return links.findIndex((link) => link.name === name);
}
const ties = ["loops", "springs", "bushings"].flatMap((kind) => (run.drawing[kind] || []).map((tie) => {
  const ends = ["a", "b"].map((side) => {
    const link = carrier(tie[`link_${side}`]), point = tie[`point_${side}`];
    return { link, point: link < 0 ? point : seen(links[link].start, point) };
  });
  return { kind, name: tie.name, ends };
}));
// contact shapes: their frames relative to their links, and the columns of the force on the first link
function isTerrain(shape) {
  return shape.kind === "plane" || shape.kind === "heightmap";
}
const contacts = (run.drawing.contacts || []).map((contact) => {
  const shapes = [contact.a, contact.b].map((shape) => {
    const link = carrier(shape.link), start = link < 0 ? IDENTITY : links[link].start;
    return { ...shape, link, R: times(transposed(start.R), shape.rotation.flat()), p: seen(start, shape.origin) };
  });
  const vector = (group) => [1, 2, 3].map((k) => columns.get(`${contact.name}.${group}[${k}]`));
  const [force, point] = [vector("force"), vector("point")].map((parts) => (parts.every(Boolean) ? parts : null));
  return { name: contact.name, shapes, force, point };
});
// a plane or height map of several contacts is drawn once
const terrains = [...new Map(contacts.flatMap((contact) => contact.shapes).filter(isTerrain).map((shape) => [JSON.stringify(shape), shape])).values()];
function shapePose(shape, poses) {
  const base = shape.link < 0 ? IDENTITY : poses[shape.link];
  return { R: times(base.R, shape.R), p: place(base, shape.p) };
}
// points around a shape, in its frame
function hull({ kind, points, half_size: box, radius: r, half_length: half = 0 }) {
  if (isTerrain({ kind })) return [];
  if (kind === "points") return points;
  const [x, y, z] = kind === "box" ? box : [r, r, half + r];
  return [-1, 1].flatMap((i) => [-1, 1].flatMap((j) => [-1, 1].map((k) => [i * x, j * y, k * z])));
}

let posed = null; // values of the sliders of the pose explorer
function posesAt(row) {
  const poses = [];
  for (const link of links) {
    const base = link.parent < 0 ? IDENTITY : poses[link.parent];
    if (link.ball) {
      const from = link.ball.base < 0 ? IDENTITY : poses[link.ball.base];
      const turn = posed ? matrixOf(quaternionOf(link.sliders.map((k) => posed[k]))) : turnAt(link.ball.columns, row);
      poses.push({ R: times(times(from.R, link.ball.R), turn), p: place(from, link.ball.p) });
      continue;
    }
    let R = times(base.R, link.R), p = place(base, link.p);
    const moved = posed && link.sliders ? posed[link.sliders[0]] - link.q0 : link.column ? valueAt(link.column, row) - link.q0 : 0;
    if (moved && link.slide) p = plus(p, [R[2], R[5], R[8]], link.slide * moved);
    if (moved && link.turn) {
      const c = Math.cos(link.turn * moved), s = Math.sin(link.turn * moved);
      R = times(R, [c, -s, 0, s, c, 0, 0, 0, 1]);
    }
    poses.push({ R, p });
  }
  return poses;
}
function endOf(end, poses) {
  return end.link < 0 ? end.point : place(poses[end.link], end.point);
}
