// Racing on any track: a policy that is shown the next three gates with axes and openings.
import { clamp, distance } from "../simulation/vectors.js";
import { progressOf, raced } from "./race.js";
import { offsets } from "./verdicts.js";

const SHOWN = 3;
const STRAIGHT_ON = 3;
const HIGHEST = 3;

/** The next gates; behind the last one of an open track others follow straight on. @type {(memory: any) => any[]} */
function ahead(memory) {
  const { gates, count, closed } = memory.tracks;
  return Array.from({ length: SHOWN }, (_, i) => {
    const onward = (memory.passed % count) + i;
    const row = closed ? onward % count : Math.min(onward, count - 1);
    const axis = [gates.cos[row], gates.sin[row], 0];
    const beyond = closed ? 0 : STRAIGHT_ON * (onward - row);
    const centre = gates.position[row].map((/** @type {number} */ x, /** @type {number} */ k) => x + beyond * axis[k]);
    return { centre, axis, half: gates.half[row] };
  });
}

/** @type {import("./index.js").Task} */
export const anyRace = {
  goesOn: true,
  goal: (_task, memory) => ahead(memory)[0].centre,
  observe(_task, memory, _time, body) {
    const shown = ahead(memory);
    const centres = shown.map((gate) => gate.centre);
    const openings = shown.flatMap((gate) => gate.half.map((/** @type {number} */ x) => 2 * x));
    return [
      ...offsets(centres, body),
      ...shown.flatMap((gate) => gate.axis),
      ...openings,
      clamp(body.position[2], 0, HIGHEST),
    ];
  },
  advance(task, memory, before, after) {
    const { gates, count, closed } = memory.tracks;
    const index = memory.passed % count;
    const last = memory.passed === 0 ? gates.start : gates.position[(index + count - 1) % count];
    const fence = task.config.fence + distance(last, gates.position[index]);
    const laps = closed ? task.config.laps : 1;
    const end = laps > 0 && memory.passed + 1 >= laps * count;
    const outcome = raced({ gates, count, shape: task.shape, fence }, index, before, after, end);
    return { memory: { ...memory, passed: memory.passed + (outcome.arrived ? 1 : 0) }, outcome };
  },
  progress: (_task, memory) => progressOf(memory.passed, memory.tracks.count, memory.tracks.closed),
};
