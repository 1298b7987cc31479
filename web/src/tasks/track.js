// Follow a reference that is seen one second ahead (e2efly/courses/references.py).
import { clamp, distance } from "../simulation/vectors.js";
import { because, offsets, touchesGround } from "./verdicts.js";

const POINTS = 10;
const SPACING = 0.1;

/** A spline of quintic pieces at a time, s, world, m; held at the ends. @type {(spline: any, time: number) => number[]} */
export function pointOf(spline, time) {
  const { knots, period: h } = spline;
  const u = clamp(time, 0, durationOf(spline)) / h;
  const index = Math.min(Math.trunc(u), knots.length - 2);
  const s = u - index;
  const [a, b] = [knots[index], knots[index + 1]];
  return [0, 1, 2].map((i) => {
    const [p0, v0, a0] = [a[0][i], a[1][i] * h, (a[2][i] * h * h) / 2];
    const [p1, v1, a1] = [b[0][i], b[1][i] * h, (b[2][i] * h * h) / 2];
    const d = p1 - p0;
    const c3 = 10 * d - 6 * v0 - 4 * v1 - 3 * a0 + a1;
    const c4 = -15 * d + 8 * v0 + 7 * v1 + 3 * a0 - 2 * a1;
    const c5 = 6 * d - 3 * v0 - 3 * v1 - a0 + a1;
    return p0 + s * (v0 + s * (a0 + s * (c3 + s * (c4 + s * c5))));
  });
}

/** Seconds after which a spline is held. @type {(spline: any) => number} */
export const durationOf = ({ knots, period, end }) => Math.min(end, (knots.length - 1) * period);

/** @type {import("./index.js").Task} */
export const track = {
  goal: (_task, memory, time) => pointOf(memory.reference, time),
  observe(_task, memory, time, body) {
    const points = Array.from({ length: POINTS }, (_, i) => pointOf(memory.reference, time + SPACING * i));
    return offsets(points, body);
  },
  advance(task, memory, _before, after, time, timedOut) {
    const { config } = task;
    const error = distance(after.position, pointOf(memory.reference, time));
    const counts = time > config.settle_s ? 1 : 0;
    const moved = { ...memory, error_sum: memory.error_sum + counts * error, steps: memory.steps + counts };
    const mean = moved.error_sum / Math.max(moved.steps, 1);
    const fault = because(
      [touchesGround(task.shape, after), "touched the ground"],
      [error > config.fence, "left the reference"],
    );
    const crashed = fault !== "";
    const success = timedOut && !crashed && mean < config.mean_error;
    const why = because([crashed, fault], [timedOut && !success, `${mean.toFixed(2)} m off on average`]);
    return { memory: moved, outcome: { terminated: crashed, success, arrived: false, crashed, error, why } };
  },
};
