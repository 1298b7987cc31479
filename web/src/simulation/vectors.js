// Vectors [x, y, z] and unit quaternions [w, x, y, z] that turn body vectors into world vectors (e2efly/control/vectors.py).

/** @typedef {number[]} Vector */
/** @typedef {number[]} Quaternion */

/** @type {(a: number[], b: number[]) => number[]} */
export const add = (a, b) => a.map((x, i) => x + b[i]);
/** @type {(a: number[], b: number[]) => number[]} */
export const subtract = (a, b) => a.map((x, i) => x - b[i]);
/** Entry by entry. @type {(a: number[], b: number[]) => number[]} */
export const times = (a, b) => a.map((x, i) => x * b[i]);
/** @type {(a: number[], factor: number) => number[]} */
export const scale = (a, factor) => a.map((x) => x * factor);
/** @type {(a: number[], b: number[]) => number} */
export const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
/** @type {(a: number[]) => number} */
export const norm = (a) => Math.sqrt(dot(a, a));
/** @type {(a: number[], b: number[]) => number} */
export const distance = (a, b) => norm(subtract(a, b));
/** @type {(x: number, low: number, high: number) => number} */
export const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
/** Each entry within [-limit, limit]. @type {(a: number[], limit: number[]) => number[]} */
export const clip = (a, limit) => a.map((x, i) => clamp(x, -limit[i], limit[i]));

/** @type {(a: Vector, b: Vector) => Vector} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** Hamilton product: turn by `b`, then by `a`. @type {(a: Quaternion, b: Quaternion) => Quaternion} */
export const compose = (a, b) => [
  a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
  a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
  a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
  a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
];

/** @type {(q: Quaternion) => Quaternion} */
export const conjugate = (q) => [q[0], -q[1], -q[2], -q[3]];
/** @type {(q: number[]) => Quaternion} */
export const normalized = (q) => scale(q, 1 / norm(q));

/** dq/dt = q (0, rate) / 2 at a body rate, rad/s. @type {(q: Quaternion, rate: Vector) => number[]} */
export const turning = (q, rate) => scale(compose(q, [0, ...rate]), 0.5);

/** Body to world. @type {(q: Quaternion, v: Vector) => Vector} */
export function rotate(q, v) {
  const u = q.slice(1);
  const t = scale(cross(u, v), 2);
  return add(add(v, scale(t, q[0])), cross(u, t));
}

/** World to body. @type {(q: Quaternion, v: Vector) => Vector} */
export const unrotate = (q, v) => rotate(conjugate(q), v);

/** The body's z axis in the world. @type {(q: Quaternion) => Vector} */
export const zAxis = (q) => [
  2 * (q[1] * q[3] + q[0] * q[2]),
  2 * (q[2] * q[3] - q[0] * q[1]),
  1 - 2 * (q[1] * q[1] + q[2] * q[2]),
];

/** R = Rz(yaw) Ry(pitch) Rx(roll), rad. @type {(roll: number, pitch: number, yaw: number) => Quaternion} */
export function ofEuler(roll, pitch, yaw) {
  const [cr, cp, cy] = [roll, pitch, yaw].map((x) => Math.cos(x / 2));
  const [sr, sp, sy] = [roll, pitch, yaw].map((x) => Math.sin(x / 2));
  return [
    cy * cp * cr + sy * sp * sr,
    cy * cp * sr - sy * sp * cr,
    cy * sp * cr + sy * cp * sr,
    sy * cp * cr - cy * sp * sr,
  ];
}
