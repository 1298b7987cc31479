// From the command of each mode down to collective thrust and body rates (e2efly/control/cascade.py, modes.py).
import { add, clamp, clip, compose, conjugate, dot, norm, ofEuler, scale, subtract, times, zAxis } from "./vectors.js";

export const GRAVITY = 9.81;

/** @typedef {{thrust: number, rate: number[]}} Ctbr Collective thrust over mass, m/s^2, and body rates, rad/s. */
/** @typedef {(vehicle: any, state: any, command: number[]) => Ctbr} Controller */

/** Command modes by name; null: thrusts of the rotors, below the rate loop. @type {Record<string, Controller | null>} */
export const CONTROLLERS = {
  rotor_thrust: null,
  rotor_share: null,
  ctbr: (vehicle, state, command) => limited(vehicle, command[0], command.slice(1)),
  attitude: (vehicle, state, [thrust, ...angles]) =>
    turn(vehicle, state, thrust, ofEuler(angles[0], angles[1], angles[2])),
  acceleration: (vehicle, state, command) => accelerate(vehicle, state, command.slice(0, 3), command[3]),
  velocity: (vehicle, state, command) => reach(vehicle, state, command.slice(0, 3), command[3]),
  position: (vehicle, state, command) => {
    const error = subtract(command.slice(0, 3), state.position);
    return reach(vehicle, state, clip(times(error, vehicle.position_gain), vehicle.speed_max), command[3]);
  },
};

/** @type {(vehicle: any, state: any, wanted: number[], yaw: number) => Ctbr} */
const reach = (vehicle, state, wanted, yaw) =>
  accelerate(vehicle, state, times(subtract(wanted, state.velocity), vehicle.velocity_gain), yaw);

/** @type {(vehicle: any, state: any, wanted: number[], yaw: number) => Ctbr} */
function accelerate(vehicle, state, wanted, yaw) {
  const [x, y, z] = clip(wanted, vehicle.acceleration_max);
  const up = Math.max(z + GRAVITY, 0.1 * GRAVITY);
  const furthest = up * Math.tan(vehicle.tilt_max);
  const shrink = furthest / Math.max(Math.sqrt(x * x + y * y), furthest);
  const force = [x * shrink, y * shrink, up];
  const axis = scale(force, 1 / norm(force));
  const half = Math.sqrt((1 + axis[2]) / 2);
  const tilt = [half, -axis[1] / (2 * half), axis[0] / (2 * half), 0];
  const attitude = compose(tilt, [Math.cos(yaw / 2), 0, 0, Math.sin(yaw / 2)]);
  return turn(vehicle, state, Math.max(dot(zAxis(state.quaternion), force), 0), attitude);
}

/** @type {(vehicle: any, state: any, thrust: number, wanted: number[]) => Ctbr} */
function turn(vehicle, state, thrust, wanted) {
  const [w, x, y, z] = compose(conjugate(state.quaternion), wanted);
  const n = Math.sqrt(w * w + z * z + 1e-12);
  const [tilt, yaw] = scale(vehicle.attitude_gain, 2 / n);
  return limited(vehicle, thrust, [
    tilt * (w * x - y * z),
    tilt * (w * y + x * z),
    yaw * (w >= 0 ? 1 : -1) * z,
  ]);
}

/** @type {(vehicle: any, thrust: number, rate: number[]) => Ctbr} */
const limited = (vehicle, thrust, rate) => ({ thrust, rate: clip(rate, vehicle.body_rate_max) });

/** Rotor thrusts within their limits, N; attitude goes before thrust (e2efly/physics/mixer.py).
 * @type {(mixer: any, collective: number, torque: number[]) => number[]} */
export function rotorThrusts(mixer, collective, torque) {
  const { thrust_min: low, thrust_max: high } = mixer;
  const spread = mixer.matrix.map((/** @type {number[]} */ row) => dot(row.slice(1), torque));
  const available = high - low;
  const share = available / Math.max(Math.max(...spread) - Math.min(...spread), available);
  const asked = add(
    mixer.matrix.map((/** @type {number[]} */ row) => row[0] * collective),
    scale(spread, share),
  );
  const shift = Math.max(low - Math.min(...asked), 0) - Math.max(Math.max(...asked) - high, 0);
  return asked.map((f) => clamp(f + shift, low, high));
}
