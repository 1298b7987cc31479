// Through a narrow slit in a wall, tilted so that only a banked vehicle fits.
import { add, cross, distance, rotate, scale, subtract, unrotate } from "../simulation/vectors.js";
import { because, offsets } from "./verdicts.js";

/** The wall reaches this far around the opening, m. */
export const WALL_WIDTH = 3;
const RIM = 8;

/** The middle of the slit and the point behind it. @type {(task: any, memory: any) => number[][]} */
function targets(task, memory) {
  const through = rotate(memory.quaternion, [1, 0, 0]);
  return [memory.centre, add(memory.centre, scale(through, task.config.beyond))];
}

/** Points on both rims of the vehicle's body, body frame. @type {(shape: any) => number[][]} */
const rims = (shape) =>
  [1, -1].flatMap((side) =>
    Array.from({ length: RIM }, (_, i) => {
      const angle = (2 * Math.PI * i) / RIM;
      return [shape.radius * Math.cos(angle), shape.radius * Math.sin(angle), side * shape.feet_height];
    }),
  );

/** Whether a point of the body was in the wall or the ground during a step, on the cubic between its ends.
 * @type {(task: any, memory: any, before: any, after: any) => boolean} */
function touched(task, memory, before, after) {
  const { config, control_period: h, checks } = task;
  const half = config.opening.map((/** @type {number} */ x) => x / 2);
  return rims(task.shape).some((point) => {
    const [start, end] = [before, after].map((body) => {
      const place = add(body.position, rotate(body.quaternion, point));
      return { place, speed: add(body.velocity, rotate(body.quaternion, cross(body.body_rate, point))) };
    });
    return Array.from({ length: checks }, (_, k) => (k + 1) / checks).some((s) => {
      const path = [
        scale(start.place, (1 + 2 * s) * (1 - s) ** 2),
        scale(start.speed, h * s * (1 - s) ** 2),
        scale(end.place, s * s * (3 - 2 * s)),
        scale(end.speed, h * s * s * (s - 1)),
      ].reduce(add);
      const [x, y, z] = unrotate(memory.quaternion, subtract(path, memory.centre)).map(Math.abs);
      const across = y < half[0] + WALL_WIDTH && z < half[1] + WALL_WIDTH;
      const opened = y < half[0] && z < half[1];
      return (x < config.thickness / 2 && across && !opened) || path[2] < 0;
    });
  });
}

/** @type {import("./index.js").Task} */
export const gap = {
  goal: (task, memory) => targets(task, memory)[memory.passed ? 1 : 0],
  observe: (task, memory, _time, body) => [
    ...offsets(targets(task, memory), body),
    ...rotate(memory.quaternion, [1, 0, 0]),
    ...rotate(memory.quaternion, [0, 0, 1]),
  ],
  advance(task, memory, before, after) {
    const { config } = task;
    const [a, b] = [before, after].map((body) => unrotate(memory.quaternion, subtract(body.position, memory.centre)));
    const share = a[0] / (a[0] === b[0] ? 1 : a[0] - b[0]);
    const [y, z] = [1, 2].map((i) => Math.abs(a[i] + share * (b[i] - a[i])));
    const forward = a[0] < 0 && b[0] >= 0 && !memory.passed;
    const inside = y < config.opening[0] / 2 && z < config.opening[1] / 2;
    const moved = { ...memory, passed: memory.passed || (forward && inside) };
    const error = distance(after.position, targets(task, moved)[moved.passed ? 1 : 0]);
    const hit = touched(task, memory, before, after);
    const missed = forward && !inside;
    const lost = missed || error > config.fence;
    const reached = moved.passed && error < config.radius && !lost;
    const why = because([hit, "struck the wall"], [missed, "missed the slit"], [lost, "left the fence"]);
    const crashed = why !== "";
    const success = reached && !crashed;
    const terminated = lost || reached || (hit && config.collisions_end);
    const arrived = (forward && inside) || success;
    return { memory: moved, outcome: { terminated, success, arrived, crashed, error, why } };
  },
};
