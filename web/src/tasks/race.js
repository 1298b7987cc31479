// Fly through gates in order. Memory: the number of gates passed.
import { distance } from "../simulation/vectors.js";
import { because, judgeGates, offsets, touchesGround } from "./verdicts.js";

/** @type {(task: any) => number} */
const countOf = (task) => task.gates.cos.length;

/** @type {import("./index.js").Task} */
export const race = {
  goesOn: true,
  goal: (task, memory) => task.gates.position[memory % countOf(task)],
  observe(task, memory, _time, body) {
    const index = memory % countOf(task);
    return offsets([task.gates.position[index], task.gates.position[index + 1]], body);
  },
  advance(task, memory, before, after) {
    const { config, gates, shape } = task;
    const count = countOf(task);
    const laps = task.closed ? config.laps : 1;
    const end = laps > 0 && memory + 1 >= laps * count;
    const outcome = raced({ gates, count, shape, fence: config.fence }, memory % count, before, after, end);
    return { memory: memory + (outcome.arrived ? 1 : 0), outcome };
  },
  progress: (task, memory) => progressOf(memory, countOf(task), task.closed),
};

/** @type {(passed: number, count: number, closed: boolean) => string} */
export function progressOf(passed, count, closed) {
  return closed ? `${passed}, lap ${Math.floor(passed / count) + 1}` : `${passed} of ${count}`;
}

/** What a step came to, of a course with a next gate.
 * @type {(course: any, index: number, before: any, after: any, end: boolean) =>
 *   import("../simulation/environment.js").Outcome} */
export function raced({ gates, count, shape, fence }, index, before, after, end) {
  const judged = judgeGates(gates, count, index, before.position, after.position, shape.radius);
  const error = distance(after.position, gates.position[index]);
  const why = because(
    [judged.struck, "struck a frame"],
    [judged.missed, `missed gate ${index + 1}`],
    [touchesGround(shape, after), "touched the ground"],
    [error > fence, "left the fence"],
  );
  const crashed = why !== "";
  const arrived = judged.passed && !crashed;
  const success = arrived && end;
  return { terminated: crashed || success, success, arrived, crashed, error, why };
}
