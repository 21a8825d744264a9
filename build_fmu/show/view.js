// The view: solids of faces, drawn by WebGL or, without it, sorted by distance on a plain canvas.
const canvas = document.getElementById("view");
const pen = canvas.getContext("2d");
const lengths = links.filter((link) => !link.floats).map((link) => long(link.p)).filter((x) => x > 1e-9);
const sizes = contacts.flatMap((contact) => contact.shapes.map((shape) => 2 * Math.max(0, ...hull(shape).map(long)))).filter((x) => x > 1e-9);
const bones = (lengths.length ? lengths : sizes).sort((a, b) => a - b);
const thick = Math.min(0.036 * radius, 0.16 * (bones[bones.length >> 1] || radius));
const sides = links.length > 60 ? 6 : links.length > 20 ? 8 : 14;
const LIGHT = unit([-0.45, 0.75, 0.6]); // from the camera: left, up, near

// views by the angles around and above the mechanism
const VIEWS = { home: normal ? [0.16, 0.1] : [0.75, 0.42], front: [0, 0], side: [Math.PI / 2, 0], top: [0, Math.PI / 2], iso: [Math.PI / 4, Math.atan(Math.SQRT1_2)] };
let camera = {}, view = "home"; // null: moved by hand

// Fits the motion and a pose of the sliders into a view by moving the target and the camera.
function fit(width, height, pose) {
  const [yaw, pitch] = VIEWS[view], { points, middle } = extentInView(), visible = pose && leaves ? pose : [...points, ...(pose || [])];
  camera = { yaw, pitch, far: (normal ? 2.45 : 2.75) * radius, target: middle };
  const margin = 3 * thick;
  for (let round = 0; round < 6; round++) {
    aim(width, height);
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    for (const point of visible) {
      const [x, y, , k] = project(point), m = margin * k;
      box[0] = Math.min(box[0], x - m);
      box[1] = Math.min(box[1], y - m);
      box[2] = Math.max(box[2], x + m);
      box[3] = Math.max(box[3], y + m);
    }
    const k = camera.far / sight.focus;
    camera.target = plus(plus(camera.target, sight.across, k * ((box[0] + box[2]) / 2 - width / 2)), sight.above, k * (height / 2 - (box[1] + box[3]) / 2));
    camera.far *= Math.min(1.6, Math.max(0.6, Math.max((box[2] - box[0]) / (0.9 * width), (box[3] - box[1]) / (0.82 * height))));
  }
}

let eye, sight; // of the current frame
function aim(width, height, travelled = [0, 0, 0]) {
  const { yaw, pitch, far } = camera, target = plus(camera.target, travelled);
  const ahead = plus(scaled(right, Math.sin(yaw)), front, Math.cos(yaw));
  const back = unit(plus(scaled(ahead, Math.cos(pitch)), up, Math.sin(pitch)));
  const across = plus(scaled(right, Math.cos(yaw)), front, -Math.sin(yaw));
  sight = { across, above: cross(back, across), back, width, height, focus: 1.35 * Math.min(width, height * 1.15) };
  eye = plus(target, back, far);
}
function project(point) {
  const v = plus(point, eye, -1);
  const depth = -dot(v, sight.back);
  const k = sight.focus / Math.max(depth, 1e-6 * radius);
  return [sight.width / 2 + k * dot(v, sight.across), sight.height / 2 - k * dot(v, sight.above), depth, k];
}

let parts = []; // [depth, draw] of the visible parts
function face(points, colour, facing, both = false, opacity = 1, normals = facing) {
  if (gpu) {
    gpu.face(points, colour, normals, opacity);
    return;
  }
  const flat = points.map(project);
  if (flat.some((q) => q[2] < 0.02 * radius)) return;
  let area = 0, depth = 0;
  flat.forEach((q, i) => {
    const next = flat[(i + 1) % flat.length];
    area += q[0] * next[1] - next[0] * q[1];
    depth += q[2] / flat.length;
  });
  if (area >= 0 && !both) return; // back face
  const light = turnedToCamera(facing);
  const shade = 0.5 + 0.5 * Math.max(0, dot(light, LIGHT)) + 0.12 * Math.max(0, light[1]);
  parts.push([depth, () => fillFace(flat, toned(colour, shade), opacity)]);
}
// Fills a polygon that is moved outwards by a part of a pixel, so that there are no gaps between faces.
function fillFace(flat, fill, opacity) {
  let x = 0, y = 0;
  for (const q of flat) {
    x += q[0] / flat.length;
    y += q[1] / flat.length;
  }
  pen.beginPath();
  flat.forEach((q, i) => {
    const [dx, dy] = [q[0] - x, q[1] - y], k = opacity === 1 ? 1 + 0.7 / Math.max(0.7, Math.hypot(dx, dy)) : 1;
    if (i) pen.lineTo(x + k * dx, y + k * dy); else pen.moveTo(x + k * dx, y + k * dy);
  });
  pen.fillStyle = fill;
  pen.globalAlpha = opacity;
  pen.fill();
  pen.globalAlpha = 1;
}
function turnedToCamera(v) {
  return [dot(v, sight.across), dot(v, sight.above), dot(v, sight.back)];
}

const rgb = new Map();
function rgbOf(colour) {
  if (!rgb.has(colour)) {
    pen.fillStyle = "#000";
    pen.fillStyle = colour; // the canvas turns any colour into #rrggbb
    rgb.set(colour, [1, 3, 5].map((i) => parseInt(pen.fillStyle.slice(i, i + 2), 16)));
  }
  return rgb.get(colour);
}
const tones = new Map();
// The colour in one of 64 brightnesses, which are computed once.
function toned(colour, shade) {
  const step = Math.round(shade * 48), key = colour + step;
  if (!tones.has(key)) tones.set(key, shaded(colour, step / 48));
  return tones.get(key);
}
function shaded(colour, shade) {
  const tone = rgbOf(colour).map((x) => Math.round(shade <= 1 ? x * shade : x + (255 - x) * (shade - 1)));
  return `rgb(${tone})`;
}

// A tube from a to b, divided for sorting by depth.
function tube(a, b, ra, rb, colour, caps = true) {
  const along = plus(b, a, -1), length = long(along);
  if (length < 1e-12) return;
  const w = scaled(along, 1 / length);
  const u = unit(cross(w, Math.abs(w[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), v = cross(w, u);
  const ring = [];
  for (let i = 0; i < sides; i++) {
    const angle = 2 * Math.PI * i / sides;
    ring.push(plus(scaled(u, Math.cos(angle)), v, Math.sin(angle)));
  }
  const pieces = gpu ? 1 : Math.min(6, Math.max(1, Math.round(length / (9 * Math.max(ra, rb)))));
  const at = (k, i, r) => plus(plus(a, along, k), ring[i % sides], r);
  for (let piece = 0; piece < pieces; piece++) {
    const k0 = piece / pieces, k1 = (piece + 1) / pieces;
    const r0 = ra + (rb - ra) * k0, r1 = ra + (rb - ra) * k1;
    for (let i = 0; i < sides; i++)
      face([at(k0, i, r0), at(k0, i + 1, r0), at(k1, i + 1, r1), at(k1, i, r1)], colour, unit(plus(ring[i], ring[(i + 1) % sides])), false, 1,
        [0, 1, 1, 0].map((k) => ring[(i + k) % sides]));
  }
  if (caps) {
    face(ring.map((_, i) => at(1, i, rb)), colour, w);
    face(ring.map((_, i) => at(0, sides - 1 - i, ra)), colour, scaled(w, -1));
  }
}
function box(centre, R, half, colour, opacity = 1) {
  for (let axis = 0; axis < 3; axis++)
    for (const side of [-1, 1]) {
      const [i, j] = [(axis + 1) % 3, (axis + 2) % 3];
      const corner = (x, y) => {
        const v = [0, 0, 0];
        v[axis] = side * half[axis];
        v[i] = x * half[i];
        v[j] = y * half[j];
        return plus(centre, turned(R, v));
      };
      const around = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
      face(side > 0 ? around : around.reverse(), colour, [R[axis] * side, R[3 + axis] * side, R[6 + axis] * side], false, opacity);
    }
}
function ball(centre, r, colour) {
  if (gpu) {
    const at = (i, j) => [Math.cos(Math.PI * i / 6) * Math.sin(Math.PI * j / 8), Math.sin(Math.PI * i / 6) * Math.sin(Math.PI * j / 8), Math.cos(Math.PI * j / 8)];
    for (let i = 0; i < 12; i++)
      for (let j = 0; j < 8; j++) {
        const normals = [at(i, j + 1), at(i + 1, j + 1), at(i + 1, j), at(i, j)];
        face(normals.map((normal) => plus(centre, normal, r)), colour, normals[0], false, 1, normals);
      }
    return;
  }
  const q = project(centre);
  if (q[2] < 0.02 * radius) return;
  parts.push([q[2] - r, () => {
    const size = r * q[3];
    const fill = pen.createRadialGradient(q[0] - size * 0.35, q[1] - size * 0.4, size * 0.1, q[0], q[1], size);
    fill.addColorStop(0, shaded(colour, 1.45));
    fill.addColorStop(0.6, shaded(colour, 0.95));
    fill.addColorStop(1, shaded(colour, 0.6));
    disc(q, size, fill);
  }]);
}
function disc(q, size, fill) {
  pen.beginPath();
  pen.arc(q[0], q[1], size, 0, 2 * Math.PI);
  pen.fillStyle = fill;
  pen.fill();
}
// the symbol of a centre of mass: a disc with four sectors
function massCentre(centre, r) {
  const q = project(centre);
  if (q[2] < 0.02 * radius) return;
  parts.push([q[2] - 4 * thick, () => {
    const size = Math.max(3.2, r * q[3]);
    disc(q, size + 1, "#fff");
    disc(q, size, "#1d2733");
    pen.fillStyle = "#fff";
    for (const from of [0, Math.PI]) {
      pen.beginPath();
      pen.moveTo(q[0], q[1]);
      pen.arc(q[0], q[1], size - 0.8, from, from + Math.PI / 2);
      pen.fill();
    }
  }]);
}
function polyline(points, colour, width) {
  for (let i = 1; i < points.length; i++) {
    const a = project(points[i - 1]), b = project(points[i]);
    if (Math.min(a[2], b[2]) < 0.02 * radius) continue;
    if (gpu) {
      wire(points[i - 1], points[i], width / (a[3] + b[3]), colour);
      continue;
    }
    parts.push([(a[2] + b[2]) / 2, () => {
      pen.beginPath();
      pen.moveTo(a[0], a[1]);
      pen.lineTo(b[0], b[1]);
      pen.strokeStyle = colour;
      pen.lineWidth = width;
      pen.stroke();
    }]);
  }
}
function wire(a, b, r, colour) {
  const w = unit(plus(b, a, -1)), u = unit(cross(w, Math.abs(w[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), ring = [u, cross(w, u), scaled(u, -1), cross(u, w)];
  ring.forEach((from, i) => {
    const to = ring[(i + 1) % 4];
    face([plus(a, from, r), plus(a, to, r), plus(b, to, r), plus(b, from, r)], colour, from, false, 1, [from, to, to, from]);
  });
}
function coil(a, b) {
  const along = plus(b, a, -1), w = unit(along);
  const u = unit(cross(w, Math.abs(w[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), v = cross(w, u), points = [a];
  for (let k = 0; k <= 96; k++) {
    const angle = 2 * Math.PI * 8 * k / 96, r = 1.1 * thick * Math.min(1, k / 8, (96 - k) / 8);
    points.push(plus(plus(plus(a, along, 0.12 + 0.76 * k / 96), u, r * Math.cos(angle)), v, r * Math.sin(angle)));
  }
  polyline([...points, b], "#2e8b57", 2.2);
}
