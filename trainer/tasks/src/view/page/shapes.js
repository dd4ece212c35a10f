// Solids as triangles. Each corner has seven numbers: a place, whether it belongs to the upper (1) or lower (-1) end of a
// capsule, and a normal.

function ball() {
  const [rings, sides] = [24, 36];
  const corners = [];
  const put = (ring, side, end) => {
    const [tilt, turn] = [(ring / rings) * Math.PI, (side / sides) * 2 * Math.PI];
    const place = [Math.sin(tilt) * Math.cos(turn), Math.sin(tilt) * Math.sin(turn), Math.cos(tilt)];
    corners.push(...place, end, ...place);
  };
  for (let ring = 0; ring < rings; ring++) {
    const end = ring < rings / 2 ? 1 : -1;
    for (let side = 0; side < sides; side++) {
      for (const [r, s] of [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]]) put(ring + r, side + s, end);
    }
  }
  // The straight part of a capsule; of a sphere it has no height.
  for (let side = 0; side < sides; side++) {
    for (const [end, s] of [[1, 0], [-1, 0], [-1, 1], [1, 0], [-1, 1], [1, 1]]) put(rings / 2, side + s, end);
  }
  return corners;
}

function cylinder() {
  const sides = 48;
  const corners = [];
  for (let side = 0; side < sides; side++) {
    const rim = (s) => [Math.cos(((side + s) / sides) * 2 * Math.PI), Math.sin(((side + s) / sides) * 2 * Math.PI)];
    const [a, b] = [rim(0), rim(1)];
    for (const [[x, y], z] of [[a, -1], [b, -1], [b, 1], [a, -1], [b, 1], [a, 1]]) corners.push(x, y, z, 0, x, y, 0);
    for (const z of [1, -1]) {
      const rest = z > 0 ? [a, b] : [b, a];
      for (const [x, y] of [[0, 0], ...rest]) corners.push(x, y, z, 0, 0, 0, z);
    }
  }
  return corners;
}

function cuboid() {
  const corners = [];
  for (let axis = 0; axis < 3; axis++) {
    for (const side of [1, -1]) {
      const normal = [0, 0, 0];
      normal[axis] = side;
      for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) {
        const place = [0, 0, 0];
        place[axis] = side;
        place[(axis + 1) % 3] = a * side;
        place[(axis + 2) % 3] = b;
        corners.push(...place, 0, ...normal);
      }
    }
  }
  return corners;
}

function square() {
  const corners = [];
  for (const [x, y] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) corners.push(x, y, 0, 0, 0, 0, 1);
  return corners;
}

// A mesh has no normals of its own: the drawing takes those of its triangles.
function meshCorners(mesh) {
  const shares = wordsOf(mesh.points, Uint16Array);
  const corners = new Float32Array((shares.length / 3) * 7);
  for (let point = 0; point < shares.length / 3; point++) {
    for (let i = 0; i < 3; i++) {
      corners[point * 7 + i] = mesh.low[i] + ((mesh.high[i] - mesh.low[i]) * shares[point * 3 + i]) / 65535;
    }
  }
  return { corners, order: wordsOf(mesh.corners, Uint32Array) };
}

// How a solid stretches its shape: along each axis, and how far it moves a capsule's ends apart.
function stretchOf(solid) {
  const [a, b, c] = solid.size;
  switch (solid.form) {
    case 'sphere': return [a, a, a, 0];
    case 'capsule': return [a, a, a, b];
    case 'cylinder': return [a, a, b, 0];
    case 'mesh': return [1, 1, 1, 0];
    default: return [a, b, c, 0];
  }
}

// A radius around a solid's origin that holds it all; 0 for a plane, which would hide everything else.
function reachOf(solid) {
  const [a, b, c] = solid.size;
  switch (solid.form) {
    case 'plane': return 0;
    case 'sphere': return a;
    case 'capsule': return a + b;
    case 'cylinder': return Math.hypot(a, b);
    case 'mesh': {
      const { low, high } = DATA.meshes[solid.mesh];
      return Math.hypot(...low.map((x, i) => Math.max(Math.abs(x), Math.abs(high[i]))));
    }
    default: return Math.hypot(a, b, c);
  }
}
