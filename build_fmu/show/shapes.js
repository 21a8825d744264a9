// Shapes of the model file: triangles in link frames.
const shapes = (run.drawing.solids || []).map(({ link, colour, points, triangles }) => {
  const flat = numbers(points, Float32Array), index = numbers(triangles, Uint16Array), corners = [], faces = [];
  for (let i = 0; i < flat.length; i += 3) corners.push([flat[i], flat[i + 1], flat[i + 2]]);
  for (let i = 0; i < index.length; i += 3) {
    const [a, b, c] = [index[i], index[i + 1], index[i + 2]];
    const normal = unit(cross(plus(corners[b], corners[a], -1), plus(corners[c], corners[a], -1)));
    faces.push({ a, b, c, normal });
  }
  return { link, colour: colour || (link < 0 ? "#8b97a3" : links[link].colour), corners, faces };
});
// links that need no rods and joints beside the shapes: those with shapes, parts fixed to them, and frames without mass
const shapedLinks = new Set(shapes.map((shape) => shape.link));
function isShaped(i) {
  if (!shapes.length || !tick("shapes")) return false;
  return i < 0 || shapedLinks.has(i) || links[i].mass === 0 || (links[i].type === "fixed" && isShaped(links[i].parent));
}

function placedShapes(poses) {
  return tick("shapes") ? shapes.map((shape) => ({ shape, pose: shape.link < 0 ? IDENTITY : poses[shape.link] })) : [];
}
function paintShapes(poses) {
  if (!tick("shapes")) return;
  for (const { link, colour, corners, faces } of shapes) {
    const pose = link < 0 ? IDENTITY : poses[link];
    const flat = corners.map((corner) => project(place(pose, corner)));
    for (const { a, b, c, normal } of faces) {
      const p = flat[a], q = flat[b], r = flat[c];
      if (Math.min(p[2], q[2], r[2]) < 0.02 * radius) continue;
      // back faces are clockwise
      if ((q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1]) >= 0) continue;
      const light = turnedToCamera(turned(pose.R, normal));
      const fill = toned(colour, 0.5 + 0.5 * Math.max(0, dot(light, LIGHT)) + 0.12 * Math.max(0, light[1]));
      parts.push([(p[2] + q[2] + r[2]) / 3, () => fillFace([p, q, r], fill, 1)]);
    }
  }
}
// The triangles that face up, on the floor.
function shadeShapes(ink, poses) {
  if (!tick("shapes")) return;
  ink.fillStyle = ink.strokeStyle;
  ink.beginPath();
  for (const { link, corners, faces } of shapes) {
    const pose = link < 0 ? IDENTITY : poses[link], flat = corners.map((corner) => project(onFloor(place(pose, corner))));
    for (const { a, b, c, normal } of faces) {
      if (dot(turned(pose.R, normal), floorNormal) <= 0 || Math.min(flat[a][2], flat[b][2], flat[c][2]) < 0.05 * radius) continue;
      ink.moveTo(flat[a][0], flat[a][1]);
      ink.lineTo(flat[b][0], flat[b][1]);
      ink.lineTo(flat[c][0], flat[c][1]);
    }
  }
  ink.fill();
}
