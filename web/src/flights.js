// Flights of the policy: episodes that are watched step by step, and whole flights as fast as the machine computes.
import { bytesOf, machine } from "./machine.js";

/** Speed, m/s, and body rate, rad/s, that a throw adds to each axis at most. */
const THROW = { velocity: 2.5, rate: 6 };
const VEHICLE = "vehicle.";
const WHY = "why.";

/** @typedef {{wind: number[], mass: number, thrust: number, delay: number}} Conditions
 * Velocity of the air in the world, m/s; mass and thrust relative to the vehicle's file; s from an observation to its
 * command. */
/** @typedef {{course: any, start: any, state: Record<string, number[]>, time: number,
 *   vehicles: Record<string, number[]>[], goals: number[][], observations: number[][]}} World Its vehicles and their
 *   task between two actions. */
/** @typedef {{terminated: boolean, truncated: boolean, success: boolean, arrived: boolean, crashed: boolean,
 *   error: number, signals: string[]}} Outcome What a control step came to: the world succeeds if all of its vehicles do
 *   and ends with any of them; arrived and error are of the first. What else the task says is true of one. */
/** @typedef {(observation: number[], memory: number[]) => {action: number[], memory: number[]}} Act */

/** @typedef {object} Episode A flight that is watched.
 * @property {World} world now
 * @property {World} before a control step ago: what is drawn lies between the two
 * @property {number[][]} memories the policy's, for each vehicle
 * @property {number} arrivals how many goals the first vehicle has reached
 * @property {Outcome | null} outcome of the last step
 * @property {Outcome | null} verdict the outcome that ended the episode; of its signals, those that became true then
 * @property {number} over seconds since it ended
 * @property {boolean} still whether nothing moves any more */

/** @type {WeakMap<any, import("./machine.js").Run>} */
const prepared = new WeakMap();

/** @type {(program: import("./machine.js").Program, given: Record<string, number[]>) => Record<string, number[]>} */
function run(program, given) {
  let ready = prepared.get(program);
  if (!ready) prepared.set(program, (ready = machine(program)));
  return ready(given);
}

/** The policy of a page. @type {(flight: any) => Act} */
export const policyOf = (flight) => (observation, memory) => {
  const found = run(flight.policy, flight.memory_size ? { observation, memory } : { observation });
  return { action: found.action, memory: found.next_memory ?? memory };
};

/** Numbers of all vehicles, one after the other, as those of each. @type {(numbers: number[], count: number) => number[][]} */
function rows(numbers, count) {
  const size = numbers.length / count;
  return Array.from({ length: count }, (_, i) => numbers.slice(i * size, (i + 1) * size));
}

/** @type {(course: any, start: any, state: Record<string, number[]>) => World} */
function worldOf(course, start, state) {
  const { agents } = course;
  const own = Object.entries(state).filter(([name]) => name.startsWith(VEHICLE));
  const each = own.map(([name, numbers]) => /** @type {const} */ ([name.slice(VEHICLE.length), rows(numbers, agents)]));
  const vehicles = Array.from({ length: agents }, (_, i) => Object.fromEntries(each.map(([name, of]) => [name, of[i]])));
  const { observation, goal } = run(course.look, state);
  const [observations, goals] = [rows(observation, agents), rows(goal, agents)];
  return { course, start, state, time: state.time[0], vehicles, goals, observations };
}

/** What the policy does with each vehicle. @type {(world: World, act: Act, memories: number[][]) => ReturnType<Act>[]} */
const acted = (world, act, memories) => world.observations.map((observation, i) => act(observation, memories[i]));

/** The policy's memories at the start. @type {(flight: any, world: World) => number[][]} */
const empty = (flight, world) => world.vehicles.map(() => Array(flight.memory_size).fill(0));

/** A world that begins. @type {(flight: any, course: number, start: number) => World} */
function begun(flight, course, start) {
  const { [course]: where } = flight.courses;
  const { [start % where.starts.length]: from } = where.starts;
  const packed = /** @type {[string, string][]} */ (Object.entries(from.state));
  const numbers = packed.map(([name, text]) => [name, Array.from(new Float64Array(bytesOf(text)))]);
  return worldOf(where, from, Object.fromEntries(numbers));
}

/** The beginning of an episode. @type {(flight: any, course: number, start: number) => Episode} */
export function episodeOf(flight, course, start) {
  const world = begun(flight, course, start);
  return { world, before: world, memories: empty(flight, world), arrivals: 0, outcome: null, verdict: null, over: 0, still: false };
}

/** The same, pushed and spun at random. @type {(episode: Episode) => Episode} */
export function thrown(episode) {
  const { course, start, state } = episode.world;
  const pushed = (/** @type {number} */ most) => (/** @type {number} */ x) => x + most * (2 * Math.random() - 1);
  const velocity = state["vehicle.velocity"].map(pushed(THROW.velocity));
  const rate = state["vehicle.body_rate"].map(pushed(THROW.rate));
  const after = { ...state, "vehicle.velocity": velocity, "vehicle.body_rate": rate };
  return { ...episode, world: worldOf(course, start, after) };
}

/** One control step under an action in [-1, 1] for each vehicle.
 * @type {(world: World, actions: number[][], conditions: Conditions) => {world: World, outcome: Outcome}} */
function advance(world, actions, conditions) {
  const hands = Object.entries(conditions).map(([name, value]) => [`hands.${name}`, [value].flat()]);
  const found = run(world.course.step, { ...world.state, ...Object.fromEntries(hands), action: actions.flat() });
  const any = (/** @type {number[]} */ flags) => flags.some((yes) => yes !== 0);
  const [terminated, truncated, crashed] = [found.terminated, found.truncated, found.crashed].map(any);
  const success = found.success.every((yes) => yes !== 0);
  const arrived = found.arrived[0] !== 0;
  const raised = Object.keys(found).filter((name) => name.startsWith(WHY) && any(found[name]));
  const signals = raised.map((name) => name.slice(WHY.length));
  const reached = Object.fromEntries(Object.keys(world.state).map((name) => [name, found[name]]));
  const outcome = { terminated, truncated, success, arrived, crashed, error: found.error[0], signals };
  return { world: worldOf(world.course, world.start, reached), outcome };
}

/** A control step later. After its end the vehicles fly on, unless one crashed or has nothing more to fly.
 * @type {(episode: Episode, act: Act, conditions: Conditions) => Episode} */
export function stepped(episode, act, conditions) {
  const { period } = episode.world.course;
  const over = episode.verdict === null ? 0 : episode.over + period;
  if (episode.still) return { ...episode, before: episode.world, over };
  const asked = acted(episode.world, act, episode.memories);
  const { world, outcome } = advance(episode.world, asked.map(({ action }) => action), conditions);
  const first = episode.verdict === null && (outcome.terminated || outcome.truncated);
  const signals = outcome.signals.filter((name) => !episode.outcome?.signals.includes(name));
  const verdict = first ? { ...outcome, signals } : episode.verdict;
  const still = outcome.crashed || (outcome.terminated && !first);
  const arrivals = episode.arrivals + Number(outcome.arrived);
  const memories = asked.map(({ memory }) => memory);
  return { world, before: episode.world, memories, arrivals, outcome, verdict, over, still };
}

/** Fly from a start for some seconds, whatever happens on the way.
 * @param {any} flight
 * @param {Act} act
 * @param {{course?: number, start?: number, seconds: number, conditions: Conditions}} options
 * @returns {any[]} each control step: time, outcome; state, observation and action of the first vehicle, and of the others */
export function fly(flight, act, { course = 0, start = 0, seconds, conditions }) {
  let world = begun(flight, course, start);
  let memories = empty(flight, world);
  const flown = [];
  for (let i = 0; i < Math.round(seconds / world.course.period); i++) {
    const { observations } = world;
    const asked = acted(world, act, memories);
    const reached = advance(world, asked.map(({ action }) => action), conditions);
    world = reached.world;
    memories = asked.map(({ memory }) => memory);
    const { signals, ...judged } = reached.outcome;
    const [own, ...others] = world.vehicles.map((vehicle, j) => ({
      ...vehicle, observation: observations[j], action: asked[j].action,
    }));
    flown.push({ time: world.time, ...own, others, ...judged });
  }
  return flown;
}
