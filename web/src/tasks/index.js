// Tasks by the kind that Python exports: what a policy is shown, where it is to be, and how it is judged.
import { anyRace } from "./any_race.js";
import { gap } from "./gap.js";
import { hover } from "./hover.js";
import { hoverAware } from "./hover_aware.js";
import { land } from "./land.js";
import { race } from "./race.js";
import { track } from "./track.js";

/** @typedef {object} Task
 * @property {(task: any, memory: any, time: number) => number[]} goal where to be now, world, m
 * @property {(task: any, memory: any, time: number, body: any) => number[]} observe the task's own fields
 * @property {(task: any, memory: any, before: any, after: any, time: number, timedOut: boolean) =>
 *   {memory: any, outcome: import("../simulation/environment.js").Outcome}} advance the verdict on a control step
 * @property {boolean} [goesOn] whether there is something to fly when it has succeeded
 * @property {(task: any, memory: any) => string} [progress] how far it is, for people */

/** @type {Record<string, Task>} */
export const TASKS = { hover, land, track, race, any_race: anyRace, gap, hover_aware: hoverAware };
