// A policy's world between two of its actions: the queue of the latency, the physics, the task, the observation
// (e2efly/env/environment.py, simulation/sensors/latency.py, simulation/sensors/imu.py).
import { TASKS } from "../tasks/index.js";
import { GRAVITY } from "./cascade.js";
import { step } from "./step.js";
import { add, clamp, normalized, scale, subtract, unrotate } from "./vectors.js";

/** The longest delay that can be asked for, s. */
export const LATEST = 0.2;
const STATE = ["position", "velocity", "quaternion", "body_rate"];

/** @typedef {{wind: number[], mass: number, delay: number}} Conditions
 * Velocity of the air in the world, m/s; mass over that of the vehicle's file; s from an observation to its command. */
/** @typedef {{flight: any, course: any, vehicle: any, memory: any, time: number, actions: number[][], past: any[],
 *   specificForce: number[]}} World One vehicle and its task between two actions; `actions` and `past` newest first. */
/** @typedef {{terminated: boolean, success: boolean, arrived: boolean, crashed: boolean, error: number,
 *   why: string}} Outcome What a control step came to; `why` tells people how it failed. */

/** The conditions of the training's middle. @type {(flight: any) => Conditions} */
export const nominal = (flight) => ({ wind: [0, 0, 0], mass: 1, delay: flight.latency });

/** @type {(delay: number, period: number) => number} */
const periods = (delay, period) => Math.ceil(delay / period - 1e-6);

/** The beginning of an episode. @type {(flight: any, course: any, start: any) => World} */
export function begin(flight, course, start) {
  const period = flight.physics.control_period;
  const kept = Math.max(periods(Math.max(LATEST, flight.latency), period) + 1, flight.past_actions, 2);
  return {
    flight,
    course,
    vehicle: start.vehicle,
    memory: start.memory,
    time: 0,
    actions: Array(kept).fill(flight.hover_action),
    past: Array(periods(flight.observation_latency, period) + 1).fill(start.vehicle),
    specificForce: unrotate(start.vehicle.quaternion, [0, 0, GRAVITY]),
  };
}

/** What the policy is told. @type {(world: World) => number[]} */
export function observe(world) {
  const { flight, course, memory, time } = world;
  const seen = delayed(world.past, flight.observation_latency / flight.physics.control_period);
  const task = TASKS[course.kind].observe(course.task, memory, time, seen);
  const inertial = flight.imu ? [...world.vehicle.body_rate, ...world.specificForce] : [];
  const last = world.actions.slice(0, flight.past_actions).flat();
  return [...task, ...seen.quaternion, ...seen.velocity, ...seen.body_rate, ...inertial, ...last];
}

/** The state some control periods ago, linear between two. @type {(past: any[], age: number) => any} */
function delayed(past, age) {
  const newer = Math.min(Math.floor(age), past.length - 1);
  const share = age - newer;
  if (share === 0 || newer === past.length - 1) return past[newer];
  const mixed = STATE.map((name) => [
    name,
    add(scale(past[newer][name], 1 - share), scale(past[newer + 1][name], share)),
  ]);
  const state = Object.fromEntries(mixed);
  return { ...state, quaternion: normalized(state.quaternion) };
}

/** One control step under an action in [-1, 1].
 * @type {(world: World, action: number[], conditions: Conditions) => {world: World, outcome: Outcome}} */
export function advance(world, action, conditions) {
  const { flight, course } = world;
  const { physics } = flight;
  const period = physics.control_period;
  const actions = [action, ...world.actions.slice(0, -1)];
  const flown = { ...physics.body, mass: physics.body.mass * conditions.mass };
  const after = step(physics, flown, world.vehicle, acting(flight, actions, conditions.delay / period), conditions.wind);
  const time = (Math.round(world.time / period) + 1) * period;
  const timedOut = time >= course.task.config.episode_s - 1e-3 * period;
  const judged = TASKS[course.kind].advance(course.task, world.memory, world.vehicle, after, time, timedOut);
  const pull = add(scale(subtract(after.velocity, world.vehicle.velocity), 1 / period), [0, 0, GRAVITY]);
  const reached = {
    ...world,
    vehicle: after,
    memory: judged.memory,
    time,
    actions,
    past: [after, ...world.past.slice(0, -1)],
    specificForce: unrotate(after.quaternion, pull),
  };
  return { world: reached, outcome: judged.outcome };
}

/** The two commands that act in the coming period, and when the second takes over, s.
 * @type {(flight: any, actions: number[][], late: number) => import("./step.js").Acting} */
function acting(flight, actions, late) {
  const whole = clamp(Math.ceil(late) - 1, 0, actions.length - 2);
  const { center, half } = flight.command;
  const command = (/** @type {number[]} */ action) => action.map((x, i) => center[i] + half[i] * clamp(x, -1, 1));
  return {
    old: command(actions[whole + 1]),
    next: command(actions[whole]),
    switched: (late - whole) * flight.physics.control_period,
  };
}
