// Fly to a point and stay there. Memory: for how long the vehicle has been within the radius, s.
import { distance, dot, subtract } from "../simulation/vectors.js";
import { because, heldLonger, touchesGround } from "./verdicts.js";

/** @type {import("./index.js").Task} */
export const hover = {
  goesOn: true,
  goal: (task) => task.config.target,
  observe: (task, _memory, _time, body) => subtract(task.config.target, body.position),
  advance(task, memory, _before, after, _time, timedOut) {
    const { config } = task;
    const error = distance(after.position, config.target);
    const held = heldLonger(memory, error < config.radius, task.control_period);
    const why = because(
      [touchesGround(task.shape, after), "touched the ground"],
      [error > config.fence, "left the fence"],
      [dot(after.body_rate, after.body_rate) > config.spin ** 2, "tumbled"],
    );
    const crashed = why !== "";
    const success = timedOut && !crashed && held >= config.hold_s - 1e-4;
    const arrived = held > 0 && memory === 0;
    return { memory: held, outcome: { terminated: crashed, success, arrived, crashed, error, why } };
  },
};
