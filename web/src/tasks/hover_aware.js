// Hover and keep a moving ball in the middle of the camera's image.
import { add, clamp, distance, ofEuler, subtract, unrotate } from "../simulation/vectors.js";
import { because, heldLonger, touchesGround } from "./verdicts.js";

const OUTSIDE = 10;
const NEAREST = 1e-3;

/** Where the ball is, world, m. @type {(memory: any, time: number) => number[]} */
export function lookAt(memory, time) {
  const angle = memory.angle + memory.rate * time;
  return add(memory.centre, [memory.away * Math.cos(angle), memory.away * Math.sin(angle), 0]);
}

/** Where the camera sees a point: right and down from the middle, in halves of the image.
 * @type {(config: any, body: any, point: number[]) => number[]} */
function pixel(config, body, point) {
  const mounted = subtract(unrotate(body.quaternion, subtract(point, body.position)), config.camera_position);
  const [ahead, left, up] = unrotate(ofEuler(0, config.camera_pitch, 0), mounted);
  if (!(ahead > NEAREST)) return [OUTSIDE, OUTSIDE];
  return [left, up].map((x, i) => clamp(-x / Math.tan(config.fov[i] / 2) / ahead, -OUTSIDE, OUTSIDE));
}

/** @type {import("./index.js").Task} */
export const hoverAware = {
  goesOn: true,
  goal: (task) => task.config.target,
  observe: (task, memory, time, body) => [
    ...subtract(task.config.target, body.position),
    ...subtract(lookAt(memory, time), body.position),
  ],
  advance(task, memory, _before, after, time, timedOut) {
    const { config, shape } = task;
    const ball = lookAt(memory, time);
    const error = distance(after.position, config.target);
    const centred = pixel(config, after, ball).every((x) => Math.abs(x) < config.centred);
    const held = heldLonger(memory.held, error < config.radius && centred, task.control_period);
    const why = because(
      [touchesGround(shape, after), "touched the ground"],
      [error > config.fence, "left the fence"],
      [distance(after.position, ball) < config.size + shape.radius, "struck the ball"],
    );
    const crashed = why !== "";
    const success = timedOut && !crashed && held >= config.hold_s - 1e-4;
    const arrived = held > 0 && memory.held === 0;
    return {
      memory: { ...memory, time, held },
      outcome: { terminated: crashed, success, arrived, crashed, error, why },
    };
  },
};
