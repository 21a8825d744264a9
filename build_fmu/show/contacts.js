// Contact shapes, planes and height maps, contact points and forces.
const FORCE = "#d7263d", OPACITY = 0.75;
const solids = contacts.flatMap((contact) => contact.shapes).filter((shape) => !isTerrain(shape));
const rounds = solids.length > 12 ? 10 : 16; // sides of a body of revolution

// 90 % of the forces are shorter than 0.4 radius, all are shorter than 0.9 radius
const forceScale = (() => {
  const sizes = [];
  for (const { force } of contacts)
    for (let i = 0; force && i < time.length; i++) sizes.push(Math.hypot(...force.map((column) => column[i])));
  const acting = sizes.filter((x) => x > 0).sort((a, b) => a - b);
  return acting.length ? 0.4 * radius / acting[Math.floor(0.9 * (acting.length - 1))] : 0;
})();

// A body of revolution about z: [height, radius] from bottom to top. Quarters of two tones show its rotation.
function turnedBody(pose, profile, colour) {
  const rows = profile.map(([z, r]) => Array.from({ length: rounds + 1 }, (_, i) => {
    const angle = 2 * Math.PI * i / rounds;
    return place(pose, [r * Math.cos(angle), r * Math.sin(angle), z]);
  }));
  const bright = shaded(colour, 1.35);
  for (let i = 1; i < rows.length; i++)
    for (let j = 1; j <= rounds; j++) {
      const corners = [rows[i - 1][j - 1], rows[i - 1][j], rows[i][j], rows[i][j - 1]];
      const facing = unit(cross(plus(corners[2], corners[0], -1), plus(corners[3], corners[1], -1)));
      const odd = (Math.floor(4 * (j - 1) / rounds) + Math.floor(2 * (i - 1) / (rows.length - 1))) % 2;
      face(corners, odd ? bright : colour, facing, false, OPACITY);
    }
}
function arc(from, to, count, point) {
  return Array.from({ length: count + 1 }, (_, i) => point(Math.cos(from + (to - from) * i / count), Math.sin(from + (to - from) * i / count)));
}
function paintSolid(shape, poses) {
  const pose = shapePose(shape, poses), { radius: r = 0, half_length: half = 0, tube: rim = 0 } = shape;
  const colour = shape.link < 0 ? css("--metal") : links[shape.link].colour, quarter = Math.PI / 2;
  if (shape.kind === "points") for (const point of shape.points) ball(place(pose, point), 0.5 * thick, colour);
  if (shape.kind === "box") box(pose.p, pose.R, shape.half_size, colour, OPACITY);
  if (shape.kind === "sphere" || shape.kind === "capsule")
    turnedBody(pose, [...arc(-quarter, 0, 4, (c, s) => [r * s - half, r * c]), ...arc(0, quarter, 4, (c, s) => [r * s + half, r * c])], colour);
  if (shape.kind === "disk")
    turnedBody(pose, [[-rim, 0], ...arc(-quarter, quarter, 6, (c, s) => [rim * s, r - rim + rim * c]), [rim, 0]], colour);
}

function paintHeights(shape, poses) {
  const pose = shapePose(shape, poses), { heights, grid } = shape;
  const rows = heights.map((row, i) => row.map((z, j) => place(pose, [j * grid, i * grid, z])));
  for (let i = 1; i < rows.length; i++)
    for (let j = 1; j < rows[0].length; j++) {
      const corners = [rows[i - 1][j - 1], rows[i - 1][j], rows[i][j], rows[i][j - 1]];
      face(corners, css("--floor"), unit(cross(plus(corners[2], corners[0], -1), plus(corners[3], corners[1], -1))), true);
    }
}

function forcesAt(row) {
  return contacts.filter(({ force, point }) => force && point).map(({ force, point }) => {
    const from = point.map((column) => valueAt(column, row)), value = force.map((column) => valueAt(column, row));
    return { from, value, length: Math.min(0.9 * radius, forceScale * long(value)) };
  }).filter(({ value }) => long(value) > 0);
}
function paintForces(row) {
  for (const { from, value, length } of forcesAt(row)) paintForce(from, value, length);
}
function paintForce(from, value, length) {
  const along = unit(value), head = Math.min(length, 2.4 * thick), neck = plus(from, along, length - head);
  ball(from, 0.6 * thick, FORCE);
  if (length > head) tube(from, neck, 0.3 * thick, 0.3 * thick, FORCE);
  tube(neck, plus(from, along, length), 0.8 * thick, 0.02 * thick, FORCE);
}
function paintContacts(poses, row) {
  for (const shape of solids) paintSolid(shape, poses);
  for (const shape of terrains) if (shape.kind === "heightmap") paintHeights(shape, poses);
  if (!posed) paintForces(row);
}
