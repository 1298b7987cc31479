// Flights of the policy: episodes that are watched step by step, and whole flights as fast as the machine computes.
import { advance, begin, observe } from "./simulation/environment.js";
import { add } from "./simulation/vectors.js";
import { TASKS } from "./tasks/index.js";

/** Speed, m/s, and body rate, rad/s, that a throw adds to each axis at most. */
const THROW = { velocity: 2.5, rate: 6 };

/** @typedef {import("./simulation/environment.js").World} World */
/** @typedef {import("./simulation/environment.js").Outcome} Outcome */
/** @typedef {import("./simulation/environment.js").Conditions} Conditions */
/** @typedef {import("./policy.js").Act} Act */

/** @typedef {object} Episode A flight that is watched.
 * @property {World} world now
 * @property {World} before a control step ago: what is drawn lies between the two
 * @property {Float32Array} memory the policy's
 * @property {Outcome | null} outcome of the last step
 * @property {Outcome | null} verdict the outcome that ended the episode
 * @property {number | null} over seconds since nothing moves any more; null: the vehicle flies */

/** The beginning of an episode. @type {(flight: any, course: number, start: number) => Episode} */
export function episodeOf(flight, course, start) {
  const { starts } = flight.courses[course];
  const world = begin(flight, flight.courses[course], starts[start % starts.length]);
  const memory = new Float32Array(flight.memory_size);
  return { world, before: world, memory, outcome: null, verdict: null, over: null };
}

/** The same, pushed and spun at random. @type {(episode: Episode) => Episode} */
export function thrown(episode) {
  const random = (/** @type {number} */ most) => [0, 0, 0].map(() => most * (2 * Math.random() - 1));
  const { vehicle } = episode.world;
  const velocity = add(vehicle.velocity, random(THROW.velocity));
  const body_rate = add(vehicle.body_rate, random(THROW.rate));
  return { ...episode, world: { ...episode.world, vehicle: { ...vehicle, velocity, body_rate } } };
}

/** A control step later. @type {(episode: Episode, act: Act, conditions: Conditions) => Promise<Episode>} */
export async function stepped(episode, act, conditions) {
  const period = episode.world.flight.physics.control_period;
  if (episode.over !== null) return { ...episode, before: episode.world, over: episode.over + period };
  const { action, memory } = await act(observe(episode.world), episode.memory);
  const { world, outcome } = advance(episode.world, action, conditions);
  const timedOut = world.time >= world.course.task.config.episode_s - 1e-3 * period;
  const ends = outcome.terminated || timedOut;
  const first = ends && episode.verdict === null;
  const verdict = first || outcome.crashed ? outcome : episode.verdict;
  const stops = outcome.crashed || (first && !(outcome.success && TASKS[world.course.kind].goesOn));
  return { world, before: episode.world, memory, outcome, verdict, over: stops ? 0 : null };
}

/** Fly from a start for some seconds, whatever happens on the way.
 * @param {any} flight
 * @param {Act} act
 * @param {{course?: number, start?: number, seconds: number, conditions: Conditions}} options
 * @returns {Promise<any[]>} each control step: time, state, observation, action and outcome */
export async function fly(flight, act, { course = 0, start = 0, seconds, conditions }) {
  let { world, memory } = episodeOf(flight, course, start);
  const rows = [];
  for (let i = 0; i < Math.round(seconds / flight.physics.control_period); i++) {
    const observation = observe(world);
    const asked = await act(observation, memory);
    const reached = advance(world, asked.action, conditions);
    world = reached.world;
    memory = asked.memory;
    rows.push({ time: world.time, ...world.vehicle, observation, action: asked.action, ...reached.outcome });
  }
  return rows;
}
