// Touch down gently on a pad at the world's origin. Memory: none.
import { norm, subtract } from "../simulation/vectors.js";
import { because, touchesGround, upright } from "./verdicts.js";

/** @type {(task: any) => number[]} */
const landed = (task) => [0, 0, task.shape.feet_height];

/** @type {import("./index.js").Task} */
export const land = {
  goal: landed,
  observe: (task, _memory, _time, body) => subtract(landed(task), body.position),
  advance(task, memory, _before, after) {
    const { config } = task;
    const offset = subtract(after.position, landed(task));
    const error = norm(offset.slice(0, 2));
    const speed = norm(after.velocity);
    const touched = touchesGround(task.shape, after);
    const lost = error > config.fence || offset[2] > config.fence;
    const fault = because(
      [!(error < config.radius), `touched ${error.toFixed(2)} m off`],
      [!(speed < config.speed), `touched at ${speed.toFixed(2)} m/s`],
      [!upright(after, config.tilt), "touched tilted"],
      [!(Math.abs(offset[2]) < config.height_error), "fell through the ground"],
    );
    const success = touched && fault === "";
    const why = because([touched && !success, fault], [lost, "left the fence"]);
    const crashed = why !== "";
    return { memory, outcome: { terminated: touched || lost, success, arrived: success, crashed, error, why } };
  },
};
