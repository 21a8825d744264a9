// Draws faces and shapes by WebGL 2: depth buffer, lambert shading, shadows of a distant light. Without a graphics card `gpu` is null, and the
// canvas draws faces sorted by distance (view.js).
const VERTEX = `#version 300 es
in vec3 point, normal; in vec4 tint;
uniform mat4 model, camera, light; uniform float lift;
out vec3 facing, seen, shade; out vec4 colour;
void main() {
  vec4 world = model * vec4(point, 1.0);
  facing = mat3(model) * normal; seen = world.xyz; colour = tint;
  vec4 lit = light * (world + vec4(lift * facing, 0.0));
  shade = 0.5 + 0.5 * lit.xyz;
  gl_Position = camera * world;
}`;
const SHADE = `#version 300 es
precision highp float; precision highp sampler2DShadow;
in vec3 facing, seen, shade; in vec4 colour; out vec4 paint;
uniform sampler2DShadow depths; uniform vec3 sun, eye, above;
float sunlight() {
  if (any(lessThan(shade.xy, vec2(0.0))) || any(greaterThan(shade.xy, vec2(1.0)))) return 1.0;
  float sum = 0.0;
  for (int i = 0; i < 4; i++) sum += texture(depths, vec3(shade.xy + (vec2(i & 1, i >> 1) - 0.5) * 1.5 / SIZE, min(shade.z, 0.9999)));
  return 0.25 * sum;
}`.replace("SIZE", "1024.0");
const SOLID = `${SHADE}
void main() {
  vec3 n = normalize(gl_FrontFacing ? facing : -facing);
  float bright = max(dot(n, sun), 0.0);
  if (bright > 0.0) bright *= sunlight();
  float shine = bright > 0.0 ? 0.16 * bright * pow(max(dot(reflect(-sun, n), normalize(eye - seen)), 0.0), 20.0) : 0.0;
  vec3 c = colour.rgb * (0.5 + 0.16 * dot(n, above) + 0.5 * bright) + shine;
  paint = vec4(c * colour.a, colour.a);
}`;
const GROUND = `${SHADE}
uniform vec3 across, along, centre, plate, line, dark; uniform float grid, reach;
void main() {
  vec2 at = vec2(dot(seen, across), dot(seen, along)), off = vec2(dot(seen - centre, across), dot(seen - centre, along)) / reach;
  vec2 near = abs(fract(at / grid - 0.5) - 0.5) / fwidth(at / grid);
  float fade = max(0.0, 1.0 - dot(off, off)), ruled = 1.0 - min(1.0, min(near.x, near.y));
  float shadow = 0.3 * (1.0 - sunlight());
  vec4 c = mix(vec4(plate, 0.6), vec4(line, 1.0), ruled);
  c = vec4(mix(c.rgb * c.a, dark, shadow), c.a + shadow * (1.0 - c.a));
  paint = c * fade;
}`;
const SHADOW_SIZE = 1024;
const STRIDE = 10; // floats of a vertex: point, normal, color

class Gpu {
  constructor(gl) {
    this.gl = gl;
    const depthOnly = "#version 300 es\nprecision lowp float; void main() {}";
    [this.solid, this.ground, this.caster] = [SOLID, GROUND, depthOnly].map((fragment) => this.program(fragment));
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, SHADOW_SIZE, SHADOW_SIZE);
    for (const [name, value] of [["COMPARE_MODE", gl.COMPARE_REF_TO_TEXTURE], ["COMPARE_FUNC", gl.LEQUAL], ["MIN_FILTER", gl.LINEAR],
      ["MAG_FILTER", gl.LINEAR], ["WRAP_S", gl.CLAMP_TO_EDGE], ["WRAP_T", gl.CLAMP_TO_EDGE]]) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${name}`], value);
    this.target = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.texture, 0);
    this.stores = { opaque: this.store(), clear: this.store(), lines: this.store(), floor: this.store() };
    this.meshes = new Map();
  }
  program(fragment) {
    const { gl } = this, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    ["point", "normal", "tint"].forEach((name, i) => gl.bindAttribLocation(program, i, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    return program;
  }
  // vertices on the graphics card and their collection of this frame
  store() {
    const { gl } = this, array = gl.createVertexArray(), buffer = gl.createBuffer();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    [3, 3, 4].forEach((size, i) => {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, size, gl.FLOAT, false, 4 * STRIDE, 12 * i);
    });
    return { array, buffer, values: new Float32Array(1 << 14), used: 0 };
  }
  vertex(store, point, normal, [r, g, b], opacity) {
    if (store.used + STRIDE > store.values.length) {
      const more = new Float32Array(2 * store.values.length);
      more.set(store.values);
      store.values = more;
    }
    const { values } = store;
    for (let k = 0; k < 3; k++) {
      values[store.used + k] = point[k];
      values[store.used + 3 + k] = normal[k];
    }
    values[store.used + 6] = r / 255;
    values[store.used + 7] = g / 255;
    values[store.used + 8] = b / 255;
    values[store.used + 9] = opacity;
    store.used += STRIDE;
  }
  upload(store) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, store.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, store.values.subarray(0, store.used), gl.DYNAMIC_DRAW);
  }
  // a convex polygon, with one normal or one of each corner
  face(points, colour, normals, opacity) {
    const store = opacity < 1 ? this.stores.clear : this.stores.opaque, at = (i) => (Array.isArray(normals[0]) ? normals[i] : normals), tone = rgbOf(colour);
    for (let i = 2; i < points.length; i++) for (const k of [0, i - 1, i]) this.vertex(store, points[k], at(k), tone, opacity);
  }
  // a flat line towards the camera, without shadow
  ribbon(a, b, width, colour, opacity) {
    const aside = scaled(unit(cross(plus(b, a, -1), plus(eye, a, -1))), width / 2), tone = rgbOf(colour);
    const [p, q, r, s] = [plus(a, aside, -1), plus(b, aside, -1), plus(b, aside), plus(a, aside)];
    for (const corner of [p, q, r, p, r, s]) this.vertex(this.stores.lines, corner, SUN, tone, opacity);
  }
  // a plane with a grid, around a center
  floor(centre, across, along, reach) {
    const corner = (i, j) => plus(plus(centre, across, i * reach), along, j * reach), normal = cross(across, along), start = this.stores.floor.used / STRIDE;
    for (const [i, j] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) this.vertex(this.stores.floor, corner(i, j), normal, [0, 0, 0], 1);
    this.floors.push({ start, centre, across, along, reach });
  }
  begin(width, height) {
    const { canvas } = this.gl;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    this.floors = [];
    for (const store of Object.values(this.stores)) store.used = 0;
  }
  // the vertices of a shape, once
  mesh(shape) {
    if (!this.meshes.has(shape)) {
      const store = this.store(), normals = cornerNormals(shape), tone = rgbOf(shape.colour);
      shape.faces.forEach(({ a, b, c }, i) => [a, b, c].forEach((corner, k) => this.vertex(store, shape.corners[corner], normals[3 * i + k], tone, 1)));
      this.upload(store);
      store.values = null;
      this.meshes.set(shape, store);
    }
    return this.meshes.get(shape);
  }
  set(program, values) {
    const { gl } = this;
    gl.useProgram(program);
    for (const [name, value] of Object.entries(values)) {
      const place = gl.getUniformLocation(program, name);
      if (typeof value === "number") gl.uniform1f(place, value);
      else if (value.length === 3) gl.uniform3fv(place, value);
      else gl.uniformMatrix4fv(place, false, value);
    }
    return gl.getUniformLocation(program, "model");
  }
  draw(place, bodies) {
    const { gl } = this;
    for (const { store, pose } of bodies) {
      const { R, p } = pose;
      gl.uniformMatrix4fv(place, false, [R[0], R[3], R[6], 0, R[1], R[4], R[7], 0, R[2], R[5], R[8], 0, ...p, 1]);
      gl.bindVertexArray(store.array);
      gl.drawArrays(gl.TRIANGLES, 0, store.used / STRIDE);
    }
  }
  // Draws what was collected, and shapes at their poses.
  end(solids, sun, centre, reach) {
    const { gl } = this, { width, height } = gl.canvas, { opaque, clear, lines } = this.stores;
    for (const store of Object.values(this.stores)) this.upload(store);
    const bodies = [{ store: opaque, pose: IDENTITY }, ...solids.map(({ shape, pose }) => ({ store: this.mesh(shape), pose }))];
    const light = lightMatrix(sun, centre, reach), camera = cameraMatrix(), lift = 3 * reach / SHADOW_SIZE;
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1.5, 3);
    this.draw(this.set(this.caster, { camera: light, light, lift: 0 }), [...bodies, { store: clear, pose: IDENTITY }]);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const shared = { camera, light, lift, sun, eye };
    const place = this.set(this.solid, { ...shared, above: up });
    this.draw(place, bodies);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    this.drawFloors(shared);
    this.draw(this.set(this.solid, shared), [{ store: lines, pose: IDENTITY }]);
    gl.enable(gl.CULL_FACE);
    this.draw(place, [{ store: clear, pose: IDENTITY }]);
    gl.depthMask(true);
  }
  drawFloors(shared) {
    const { gl } = this, tone = (name) => rgbOf(css(name)).map((x) => x / 255);
    gl.bindVertexArray(this.stores.floor.array);
    for (const { start, ...plane } of this.floors) {
      const place = this.set(this.ground, { ...shared, ...plane, plate: tone("--card"), line: tone("--floor"), dark: css("--shadow").split(",").map((x) => Number(x) / 255), grid: floorStep });
      gl.uniformMatrix4fv(place, false, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
      gl.drawArrays(gl.TRIANGLES, start, 6);
    }
  }
}
// Projections by columns. The camera is that of project() in view.js.
function cameraMatrix() {
  const { across, above, back, width, height, focus } = sight, near = 0.02 * radius, far = camera.far + 60 * radius;
  const rows = [scaled(across, 2 * focus / width), scaled(above, 2 * focus / height), scaled(back, -(far + near) / (far - near)), scaled(back, -1)];
  const last = rows.map((row) => -dot(row, eye));
  last[2] -= 2 * far * near / (far - near);
  return [0, 1, 2].flatMap((k) => rows.map((row) => row[k])).concat(last);
}
const LIT = 1.6; // radius of the space in which shadows are cast, in radii of what the view contains
function lightMatrix(sun, centre, reach) {
  const u = unit(cross(Math.abs(sun[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], sun)), v = cross(sun, u), size = 1 / reach;
  const rows = [scaled(u, size), scaled(v, size), scaled(sun, -size / 2), [0, 0, 0]];
  return [0, 1, 2].flatMap((k) => rows.map((row) => row[k])).concat(rows.map((row, k) => (k === 3 ? 1 : -dot(row, centre))));
}
// The normals of the corners of each face: mean of the faces around a point that differ by less than 40 degrees.
function cornerNormals({ corners, faces }) {
  const around = corners.map(() => []);
  for (const face of faces) for (const corner of [face.a, face.b, face.c]) around[corner].push(face.normal);
  return faces.flatMap(({ a, b, c, normal }) => [a, b, c].map((corner) =>
    unit(around[corner].reduce((sum, other) => (dot(other, normal) > 0.766 ? plus(sum, other) : sum), [0, 0, 0]))));
}
function isFast() {
  const gl = document.createElement("canvas").getContext("webgl2", { failIfMajorPerformanceCaveat: true });
  const more = gl && gl.getExtension("WEBGL_debug_renderer_info"), name = gl && gl.getParameter(more ? more.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  if (gl && gl.getExtension("WEBGL_lose_context")) gl.getExtension("WEBGL_lose_context").loseContext();
  return Boolean(gl) && !/swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}
let gpu = null;
{
  const surface = document.getElementById("solid"), box = document.getElementById("shadows");
  let kept = null;
  const use = (on) => {
    const gl = on && !kept && surface.getContext("webgl2", { antialias: true });
    if (gl) kept = new Gpu(gl);
    gpu = on ? kept : null;
    box.checked = Boolean(gpu);
    surface.hidden = !gpu;
  };
  // WebGL without a graphics card is slower than the canvas; it is used on request only
  use(isFast());
  box.onchange = () => {
    use(box.checked);
    refresh(false);
  };
  surface.addEventListener("webglcontextlost", () => {
    gpu = kept = null;
    surface.hidden = true;
    box.checked = false;
    refresh(false);
  });
}
