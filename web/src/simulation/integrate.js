// Integrators of one sub-step; the motor lag is exact in each (e2efly/physics/integrate.py).
import { accelerations } from "./body.js";
import { add, normalized, scale, subtract, turning } from "./vectors.js";

/** @typedef {(plant: any, state: any, command: number[], wind: number[], dt: number) => any} Integrator */

const PARTS = ["position", "velocity", "quaternion", "body_rate"];

/** Rotor speeds after `time` s of lag towards a constant command.
 * @type {(plant: any, speed: number[], command: number[], time: number) => number[]} */
const lagged = (plant, speed, command, time) =>
  speed.map((w, i) => {
    const constant = command[i] < w ? plant.lag.down : plant.lag.up;
    return command[i] + (w - command[i]) * Math.exp(-time / constant);
  });

/** Time derivative of the state's parts, with given rotor speeds.
 * @type {(plant: any, state: any, speed: number[], wind: number[], spinUp: number[] | null) => any} */
function derivative(plant, state, speed, wind, spinUp) {
  const { linear, angular } = accelerations(plant, { ...state, rotor_speed: speed }, wind, spinUp);
  return {
    position: state.velocity,
    velocity: linear,
    quaternion: turning(state.quaternion, state.body_rate),
    body_rate: angular,
  };
}

/** @type {(plant: any, state: any, speed: number[], command: number[], wind: number[]) => any} */
function rateAt(plant, state, speed, command, wind) {
  const spinUp = speed.map((w, i) => (command[i] - w) / (command[i] < w ? plant.lag.down : plant.lag.up));
  return derivative(plant, state, speed, wind, spinUp);
}

/** state + sum of weight * rate. @type {(state: any, ...terms: [any, number][]) => any} */
function moved(state, ...terms) {
  const parts = PARTS.map((name) => [
    name,
    terms.reduce((sum, [rate, weight]) => add(sum, scale(rate[name], weight)), state[name]),
  ]);
  return { ...state, ...Object.fromEntries(parts) };
}

/** @type {(state: any, speed: number[]) => any} */
const finished = (state, speed) => ({ ...state, quaternion: normalized(state.quaternion), rotor_speed: speed });

/** @type {(before: number[], after: number[], dt: number) => number[]} */
const meanChange = (before, after, dt) => scale(subtract(after, before), 1 / dt);

/** By name. @type {Record<string, Integrator>} */
export const INTEGRATORS = {
  euler(plant, state, command, wind, dt) {
    const speed = lagged(plant, state.rotor_speed, command, dt);
    const rate = derivative(plant, state, state.rotor_speed, wind, meanChange(state.rotor_speed, speed, dt));
    return finished(moved(state, [rate, dt]), speed);
  },
  semi_implicit(plant, state, command, wind, dt) {
    const speed = lagged(plant, state.rotor_speed, command, dt);
    const { linear, angular } = accelerations(
      plant,
      { ...state, rotor_speed: speed },
      wind,
      meanChange(state.rotor_speed, speed, dt),
    );
    const velocity = add(state.velocity, scale(linear, dt));
    const rate = add(state.body_rate, scale(angular, dt));
    const pose = { position: velocity, quaternion: turning(state.quaternion, rate) };
    return {
      ...finished(state, speed),
      position: add(state.position, scale(pose.position, dt)),
      quaternion: normalized(add(state.quaternion, scale(pose.quaternion, dt))),
      velocity,
      body_rate: rate,
    };
  },
  rk3(plant, state, command, wind, dt) {
    const middle = lagged(plant, state.rotor_speed, command, dt / 2);
    const end = lagged(plant, middle, command, dt / 2);
    const k1 = rateAt(plant, state, state.rotor_speed, command, wind);
    const k2 = rateAt(plant, moved(state, [k1, dt / 2]), middle, command, wind);
    const k3 = rateAt(plant, moved(state, [k2, 2 * dt], [k1, -dt]), end, command, wind);
    return finished(moved(state, [k1, dt / 6], [k2, (4 * dt) / 6], [k3, dt / 6]), end);
  },
  rk4(plant, state, command, wind, dt) {
    const middle = lagged(plant, state.rotor_speed, command, dt / 2);
    const end = lagged(plant, middle, command, dt / 2);
    const k1 = rateAt(plant, state, state.rotor_speed, command, wind);
    const k2 = rateAt(plant, moved(state, [k1, dt / 2]), middle, command, wind);
    const k3 = rateAt(plant, moved(state, [k2, dt / 2]), middle, command, wind);
    const k4 = rateAt(plant, moved(state, [k3, dt]), end, command, wind);
    return finished(moved(state, [k1, dt / 6], [k2, dt / 3], [k3, dt / 3], [k4, dt / 6]), end);
  },
};
