// What verdicts are made of (e2efly/tasks/verdicts.py, courses/gates.py).
import { subtract, zAxis } from "../simulation/vectors.js";

/** Width of a gate's frame around its opening, m. */
export const FRAME = 0.1;

/** @type {(shape: any, body: any) => boolean} */
export const touchesGround = (shape, body) => body.position[2] <= shape.feet_height;

/** For how long all has been well, s. @type {(held: number, well: boolean, period: number) => number} */
export const heldLonger = (held, well, period) => (well ? held + period : 0);

/** @type {(body: any, tilt: number) => boolean} */
export const upright = (body, tilt) => zAxis(body.quaternion)[2] > Math.cos(tilt);

/** Points minus the vehicle's position, one after the other. @type {(points: number[][], body: any) => number[]} */
export const offsets = (points, body) => points.flatMap((p) => subtract(p, body.position));

/** The first reason that holds, or nothing. @type {(...reasons: [boolean, string][]) => string} */
export const because = (...reasons) => reasons.find(([holds]) => holds)?.[1] ?? "";

/** What a step along a straight line came to: the next gate passed, its plane crossed elsewhere, a frame struck.
 * @type {(gates: any, count: number, index: number, before: number[], after: number[], radius: number) =>
 *   {passed: boolean, missed: boolean, struck: boolean}} */
export function judgeGates(gates, count, index, before, after, radius) {
  const verdict = { passed: false, missed: false, struck: false };
  for (let g = 0; g < count; g++) {
    const [x0, y0, z0] = local(gates, g, before);
    const [x1, y1, z1] = local(gates, g, after);
    const t = x0 / (x0 === x1 ? 1 : x0 - x1);
    const y = Math.abs(y0 + t * (y1 - y0));
    const z = Math.abs(z0 + t * (z1 - z0));
    const [wide, high] = gates.half[g];
    const inside = y < wide - radius && z < high - radius;
    const outside = y > wide + FRAME + radius || z > high + FRAME + radius;
    if (g === index && x0 < 0 && x1 >= 0) verdict[inside ? "passed" : "missed"] = true;
    if (x0 < 0 !== x1 < 0 && !inside && !outside) verdict.struck = true;
  }
  return verdict;
}

/** A point in a gate's frame: along its axis, to the left, up. @type {(gates: any, g: number, p: number[]) => number[]} */
function local(gates, g, p) {
  const [x, y, z] = subtract(p, gates.position[g]);
  return [gates.cos[g] * x + gates.sin[g] * y, gates.cos[g] * y - gates.sin[g] * x, z];
}
