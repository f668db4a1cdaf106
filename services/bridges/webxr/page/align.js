// The rigid transform that brings touched points of the rig onto where they were touched. Pure.
//
// Horn, "Closed-form solution of absolute orientation using unit quaternions", J. Opt. Soc. Am. A
// 4(4), 1987: the rotation is the eigenvector of the largest eigenvalue of a symmetric 4x4 matrix.

// Three points nearer to one line than this leave the turn about that line to their noise.
export const LEAST_HEIGHT_M = 0.03;
// Where a controller's tip is, is known to a centimetre at best: a larger residual is a wrong point.
export const GOOD_M = 0.02;

// points: arrays of [x, y, z] in metres, at least three, in the same order; target = R rig + t.
// Returns {rotation: 3 rows, translation, residuals_m, rms_m}; throws an Error for people.
export function align(rig, target) {
  if (rig.length < 3 || rig.length !== target.length) {
    throw new Error("touch three points");
  }
  for (const points of [rig, target]) {
    if (height(points) < LEAST_HEIGHT_M) {
      throw new Error("the points lie on one line or together; touch a triangle of 10 cm or more");
    }
  }
  const a = mean(rig);
  const b = mean(target);
  const q = turn(rig.map((p) => minus(p, a)), target.map((p) => minus(p, b)));
  const rotation = matrix(q);
  const translation = minus(b, times(rotation, a));
  const residuals_m = rig.map((p, k) => length(minus(target[k], plus(times(rotation, p), translation))));
  const rms_m = Math.sqrt(residuals_m.reduce((sum, r) => sum + r * r, 0) / rig.length);
  return { rotation, translation, residuals_m, rms_m };
}

// How far the points are from the line through the two that are farthest apart.
function height(points) {
  let best = 0;
  let line = null;
  for (let i = 0; i < points.length; i++) {
    for (let j = 0; j < i; j++) {
      const along = minus(points[i], points[j]);
      if (length(along) > best) {
        best = length(along);
        line = [points[j], along];
      }
    }
  }
  if (line === null) return 0;
  return Math.max(...points.map((p) => length(cross(line[1], minus(p, line[0]))) / best));
}

// The unit quaternion [w, x, y, z] of the rotation with the least squares between centred points.
function turn(from, to) {
  const s = [0, 1, 2].map((i) => [0, 1, 2].map((j) => from.reduce((sum, p, k) => sum + p[i] * to[k][j], 0)));
  const [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = s;
  const n = [
    [xx + yy + zz, yz - zy, zx - xz, xy - yx],
    [yz - zy, xx - yy - zz, xy + yx, zx + xz],
    [zx - xz, xy + yx, yy - xx - zz, yz + zy],
    [xy - yx, zx + xz, yz + zy, zz - xx - yy],
  ];
  const { values, vectors } = eigen(n);
  const largest = values.indexOf(Math.max(...values));
  return vectors.map((row) => row[largest]);
}

// Eigenvalues and eigenvectors (columns) of a symmetric matrix, by cyclic Jacobi rotations.
function eigen(symmetric) {
  const a = symmetric.map((row) => [...row]);
  const n = a.length;
  const v = a.map((row, i) => row.map((_, j) => (i === j ? 1 : 0)));
  const scale = Math.max(...a.flat().map(Math.abs), Number.MIN_VALUE);
  // Converges quadratically: a 4x4 needs five sweeps or six.
  for (let sweep = 0; sweep < 30; sweep++) {
    let off = 0;
    for (let p = 0; p < n; p++) {
      for (let q = p + 1; q < n; q++) {
        off = Math.max(off, Math.abs(a[p][q]));
        if (Math.abs(a[p][q]) < 1e-300) continue;
        const theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const t = (theta < 0 ? -1 : 1) / (Math.abs(theta) + Math.hypot(theta, 1));
        const c = 1 / Math.hypot(t, 1);
        rotate(a, v, p, q, c, t * c);
      }
    }
    if (off < 1e-15 * scale) break;
  }
  return { values: a.map((row, i) => row[i]), vectors: v };
}

function rotate(a, v, p, q, c, s) {
  for (let k = 0; k < a.length; k++) {
    [a[k][p], a[k][q]] = [c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]];
  }
  for (let k = 0; k < a.length; k++) {
    [a[p][k], a[q][k]] = [c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]];
    [v[k][p], v[k][q]] = [c * v[k][p] - s * v[k][q], s * v[k][p] + c * v[k][q]];
  }
}

function matrix([w, x, y, z]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}

const mean = (points) => [0, 1, 2].map((i) => points.reduce((sum, p) => sum + p[i], 0) / points.length);
const minus = (a, b) => a.map((value, i) => value - b[i]);
const plus = (a, b) => a.map((value, i) => value + b[i]);
const times = (m, p) => m.map((row) => row[0] * p[0] + row[1] * p[1] + row[2] * p[2]);
const length = (a) => Math.hypot(...a);
const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];
