// The robot in three dimensions: WebGL 2, one light, its shadows, and a camera that goes along.

const LIGHT = normal3([0.45, -0.55, 1]);
const SHADOW_SIZE = 2048;

function minus3(a, b) { return [a[0] - b[0], a[1] - b[1], a[2] - b[2]]; }
function dot3(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
function cross3(a, b) { return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]; }
function normal3(a) { const l = Math.hypot(...a) || 1; return [a[0] / l, a[1] / l, a[2] / l]; }
function turned([w, x, y, z], v) {
  const t = cross3([x, y, z], v).map((c, i) => c + w * v[i]);
  return cross3([x, y, z], t).map((c, i) => v[i] + 2 * c);
}
// Product of two matrices of four columns each.
function times(a, b) {
  const product = new Float32Array(16);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let k = 0; k < 4; k++) product[c * 4 + r] += a[k * 4 + r] * b[c * 4 + k];
  return product;
}
function looking(eye, at, up) {
  const f = normal3(minus3(at, eye));
  const s = normal3(cross3(f, up));
  const u = cross3(s, f);
  return [s[0], u[0], -f[0], 0, s[1], u[1], -f[1], 0, s[2], u[2], -f[2], 0, -dot3(s, eye), -dot3(u, eye), dot3(f, eye), 1];
}
function perspective(aspect, near, far) {
  const k = 1 / Math.tan(0.38);
  return [k / aspect, 0, 0, 0, 0, k, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
}
function parallel(half, depth) {
  return [1 / half, 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, -1 / depth, 0, 0, 0, 0, 1];
}

const CORNERS = `#version 300 es
layout(location = 0) in vec4 place;
layout(location = 1) in vec3 normal;
uniform mat4 camera, light;
uniform vec3 origin;
uniform vec4 rotation, stretch;
uniform vec2 shift;
out vec3 world, facing, own;
out vec4 lit;
vec3 turn(vec3 v) { return v + 2.0 * cross(rotation.yzw, cross(rotation.yzw, v) + rotation.x * v); }
void main() {
  own = place.xyz * stretch.xyz + vec3(shift, place.w * stretch.w);
  world = turn(own) + origin;
  facing = turn(normal / stretch.xyz);
  lit = light * vec4(world, 1.0);
  gl_Position = camera * vec4(world, 1.0);
}`;
const PIXELS = `#version 300 es
precision highp float;
precision highp sampler2DShadow;
in vec3 world, facing, own;
in vec4 lit;
uniform vec4 colour;
uniform vec3 eye, sun, back, ground, groundLine;
uniform float flatShaded, plane, cell, far;
uniform sampler2DShadow shadow;
out vec4 pixel;
float light(float slope) {
  vec3 at = lit.xyz * 0.5 + 0.5;
  if (any(lessThan(at, vec3(0.0))) || any(greaterThan(at, vec3(1.0)))) return 1.0;
  float sum = 0.0;
  for (int x = -1; x <= 1; x++) for (int y = -1; y <= 1; y++)
    sum += texture(shadow, vec3(at.xy + vec2(x, y) / ${SHADOW_SIZE}.0, at.z - 0.0008 - 0.002 * slope));
  return sum / 9.0;
}
float line(vec2 at, float size) {
  vec2 g = abs(fract(at / size - 0.5) - 0.5) * size;
  vec2 w = fwidth(at) * 1.2;
  vec2 l = 1.0 - smoothstep(vec2(0.0), w, g - 0.004 * size);
  return max(l.x, l.y);
}
void main() {
  vec3 n = flatShaded > 0.5 ? normalize(cross(dFdx(world), dFdy(world))) : normalize(facing);
  vec3 to_eye = eye - world;
  float away = length(to_eye);
  vec3 v = to_eye / away;
  if (dot(n, v) < 0.0) n = -n;
  float direct = max(dot(n, sun), 0.0);
  float bright = light(1.0 - direct) * direct;
  vec3 base = colour.rgb;
  if (plane > 0.5) {
    vec2 tile = floor(own.xy / cell);
    base = mix(ground, groundLine, 0.16 * mod(tile.x + tile.y, 2.0));
    base = mix(base, groundLine, 0.75 * line(own.xy, cell));
    base *= mix(0.62, 1.0, bright / max(direct, 0.001));
    float fade = smoothstep(0.35 * far, far, away);
    pixel = vec4(mix(base, back, fade), colour.a);
    return;
  }
  float sky = 0.5 + 0.5 * n.z;
  vec3 shade = base * (mix(0.34, 0.62, sky) + 0.6 * bright);
  shade += 0.18 * bright * pow(max(dot(n, normalize(sun + v)), 0.0), 48.0);
  pixel = vec4(pow(shade, vec3(0.87)), colour.a);
}`;
const SHADOW_PIXELS = `#version 300 es
precision highp float;
void main() {}`;

// Makes the function that draws a moment; null where the browser has no WebGL 2.
function makeDrawing(canvas) {
  const gl = canvas.getContext('webgl2', { antialias: true });
  if (!gl) return null;
  const program = (corners, pixels) => {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, corners], [gl.FRAGMENT_SHADER, pixels]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    const places = new Map();
    return { made, at: (name) => { if (!places.has(name)) places.set(name, gl.getUniformLocation(made, name)); return places.get(name); } };
  };
  const [seen, cast] = [program(CORNERS, PIXELS), program(CORNERS, SHADOW_PIXELS)];

  const shape = (corners, order) => {
    const vertices = gl.createVertexArray();
    gl.bindVertexArray(vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(corners), gl.STATIC_DRAW);
    for (const [place, count, from] of [[0, 4, 0], [1, 3, 16]]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, count, gl.FLOAT, false, 28, from);
    }
    if (order) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, order, gl.STATIC_DRAW);
    }
    return { vertices, count: order ? order.length : corners.length / 7, ordered: !!order };
  };
  const balls = shape(ball());
  const shapes = { sphere: balls, capsule: balls, ellipsoid: balls, cylinder: shape(cylinder()), box: shape(cuboid()), plane: shape(square()) };
  const meshes = DATA.meshes.map((mesh) => { const { corners, order } = meshCorners(mesh); return shape(corners, order); });
  const shapeOf = (solid) => (solid.form === 'mesh' ? meshes[solid.mesh] : shapes[solid.form]);

  const depth = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, depth);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, SHADOW_SIZE, SHADOW_SIZE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  const shadows = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, shadows);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, depth, 0);
  gl.drawBuffers([gl.NONE]);
  gl.enable(gl.DEPTH_TEST);

  const dark = matchMedia('(prefers-color-scheme: dark)').matches;
  const back = dark ? [0.09, 0.105, 0.14] : [0.93, 0.945, 0.965];
  const ground = dark ? [0.17, 0.195, 0.245] : [0.84, 0.86, 0.89];
  const groundLine = dark ? [0.30, 0.34, 0.41] : [0.66, 0.70, 0.76];

  // One solid. A plane without end lies around the point that is looked at, so that its rim is never seen.
  const put = (pass, solid, pose, at, radius) => {
    const made = shapeOf(solid);
    const stretch = stretchOf(solid);
    let shift = [0, 0];
    if (solid.form === 'plane') {
      const across = turned([pose[3], -pose[4], -pose[5], -pose[6]], minus3(at, pose));
      for (const i of [0, 1]) if (solid.size[i] === 0) { stretch[i] = 60 * radius; shift[i] = across[i]; }
      stretch[2] = 1;
    }
    gl.uniform3f(pass.at('origin'), pose[0], pose[1], pose[2]);
    gl.uniform4f(pass.at('rotation'), pose[3], pose[4], pose[5], pose[6]);
    gl.uniform4f(pass.at('stretch'), ...stretch);
    gl.uniform2f(pass.at('shift'), ...shift);
    gl.bindVertexArray(made.vertices);
    if (made.ordered) gl.drawElements(gl.TRIANGLES, made.count, gl.UNSIGNED_INT, 0);
    else gl.drawArrays(gl.TRIANGLES, 0, made.count);
    return made.count / 3;
  };

  // Draws solids at these poses, seen as `camera` says; returns how many triangles that took.
  return function draw(solids, poses, camera) {
    const { at, radius } = camera;
    const ratio = Math.min(devicePixelRatio, 2);
    const [width, height] = [Math.max(1, Math.round(canvas.clientWidth * ratio)), Math.max(1, Math.round(canvas.clientHeight * ratio))];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const reach = 3.2 * radius;
    const sunAt = at.map((x, i) => x + LIGHT[i] * reach);
    const light = times(parallel(reach, 2 * reach), looking(sunAt, at, [0, 1, 0]));
    const far = Math.max(14 * radius, 4 * camera.distance);
    const eye = camera.eye;
    const view = times(perspective(width / height, camera.distance / 60, far * 6), looking(eye, at, [0, 0, 1]));

    gl.bindFramebuffer(gl.FRAMEBUFFER, shadows);
    gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.useProgram(cast.made);
    gl.uniformMatrix4fv(cast.at('camera'), false, light);
    solids.forEach((solid, k) => { if (solid.form !== 'plane' && solid.colour[3] > 0.5) put(cast, solid, poses[k], at, radius); });

    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.clearColor(...back, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(seen.made);
    gl.bindTexture(gl.TEXTURE_2D, depth);
    gl.uniformMatrix4fv(seen.at('camera'), false, view);
    gl.uniformMatrix4fv(seen.at('light'), false, light);
    for (const [name, value] of [['eye', eye], ['sun', LIGHT], ['back', back], ['ground', ground], ['groundLine', groundLine]]) gl.uniform3f(seen.at(name), ...value);
    gl.uniform1f(seen.at('far'), far);
    gl.uniform1f(seen.at('cell'), 10 ** Math.round(Math.log10(radius)));
    let triangles = 0;
    const pass = (opaque) => solids.forEach((solid, k) => {
      if ((solid.colour[3] >= 1) !== opaque) return;
      gl.uniform4f(seen.at('colour'), ...solid.colour);
      gl.uniform1f(seen.at('plane'), solid.form === 'plane' ? 1 : 0);
      gl.uniform1f(seen.at('flatShaded'), solid.form === 'mesh' ? 1 : 0);
      triangles += put(seen, solid, poses[k], at, radius);
    });
    pass(true);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    pass(false);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    return { triangles, error: gl.getError(), pixels: () => covered(gl, width, height, back) };
  };
}

// The share of pixels that are not the background; only right after drawing, before the browser takes the picture.
function covered(gl, width, height, back) {
  const bytes = new Uint8Array(width * height * 4);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  let count = 0;
  for (let i = 0; i < bytes.length; i += 4) {
    if (back.some((part, k) => Math.abs(bytes[i + k] - part * 255) > 3)) count++;
  }
  return count / (width * height);
}
