// The rigid body: forces, torques and the accelerations that they give (e2efly/physics/body.py, plant.py).
import { GRAVITY } from "./cascade.js";
import { add, cross, dot, rotate, scale, subtract, times, unrotate } from "./vectors.js";

const LEAST_VOLTAGE = 0.1;

/** What sub-steps of `dt` s compute with, of a vehicle's numbers.
 * @param {any} vehicle as exported
 * @param {number} dt s */
export function plantOf(vehicle, dt) {
  const centre = vehicle.centre_of_mass;
  /** @type {number[][]} */
  const arms = vehicle.rotor_position.map(([x, y]) => (centre ? [x - centre[0], y - centre[1]] : [x, y]));
  const up = vehicle.motor_time_constant;
  const down = vehicle.motor_time_constant_down ?? up;
  return {
    ...vehicle,
    arm_x: arms.map((arm) => arm[0]),
    arm_y: arms.map((arm) => arm[1]),
    mobility: inverse(vehicle.inertia, vehicle.inertia_products),
    lag: { up, down, dt },
  };
}

/** Diagonal, and entries xy, xz and yz, of the inverse of a symmetric tensor that is given by the same.
 * @type {(diagonal: number[], products: number[] | null) => {diagonal: number[], products: number[] | null}} */
function inverse(diagonal, products) {
  if (!products) return { diagonal: diagonal.map((x) => 1 / x), products: null };
  const [a, b, c] = diagonal;
  const [xy, xz, yz] = products;
  const minors = [b * c - yz * yz, a * c - xz * xz, a * b - xy * xy];
  const mixed = [xz * yz - xy * c, xy * yz - b * xz, xy * xz - a * yz];
  const whole = 1 / (a * minors[0] + xy * mixed[0] + xz * mixed[1]);
  return { diagonal: scale(minors, whole), products: scale(mixed, whole) };
}

/** A symmetric tensor times a vector. @type {(diagonal: number[], products: number[] | null, v: number[]) => number[]} */
export function tensorTimes(diagonal, products, v) {
  const straight = times(diagonal, v);
  if (!products) return straight;
  const [xy, xz, yz] = products;
  return add(straight, [xy * v[1] + xz * v[2], xy * v[0] + yz * v[2], xz * v[0] + yz * v[1]]);
}

/** w x J w, N*m. @type {(vehicle: any, rate: number[]) => number[]} */
export const gyroscopicTorque = (vehicle, rate) =>
  cross(rate, tensorTimes(vehicle.inertia, vehicle.inertia_products, rate));

/** The rotor speeds, rad/s, that give thrusts, N. @type {(vehicle: any, thrust: number[]) => number[]} */
export function rotorSpeeds(vehicle, thrust) {
  const [k2, k1, k0] = vehicle.thrust_map;
  const half = k1 / (2 * k2);
  return thrust.map((f) => Math.sqrt(half * half + (f - k0) / k2) - half);
}

/** @type {(plant: any, speed: number[]) => number[]} */
function rotorThrust(plant, speed) {
  const [k2, k1, k0] = plant.thrust_map;
  return speed.map((w) => Math.max((k2 * w + k1) * w + k0, 0));
}

/** The speeds towards which rotors turn that are told `command`, by the battery's voltage under its load.
 * @type {(plant: any, speed: number[], command: number[]) => number[]} */
export function powered(plant, speed, command) {
  if (plant.battery_voltage === null) return command;
  let voltage = plant.battery_voltage / plant.nominal_voltage;
  if (plant.voltage_sag !== null) {
    const load = rotorThrust(plant, speed).reduce((sum, f) => sum + f, 0);
    voltage = Math.max(voltage - (plant.voltage_sag / plant.nominal_voltage) * load, LEAST_VOLTAGE);
  }
  return scale(command, voltage ** (plant.speed_per_volt ?? 1));
}

/** Of the centre of mass in the world, m/s^2, and of the body about its axes, rad/s^2.
 * @param {any} plant of `plantOf`
 * @param {any} state with the rotor speeds that push
 * @param {number[]} wind world, m/s
 * @param {number[] | null} spinUp the rotors' accelerations, rad/s^2, where their momentum counts */
export function accelerations(plant, state, wind, spinUp) {
  const { quaternion, body_rate: rate, rotor_speed: speed } = state;
  const thrust = rotorThrust(plant, speed);
  let torque = [
    dot(plant.arm_y, thrust),
    -dot(plant.arm_x, thrust),
    plant.torque_ratio * dot(plant.rotor_spin, thrust),
  ];
  if (plant.rotor_inertia !== null && spinUp) {
    const momentum = -plant.rotor_inertia * dot(plant.rotor_spin, speed);
    const change = -plant.rotor_inertia * dot(plant.rotor_spin, spinUp);
    torque = add(torque, [-rate[1] * momentum, rate[0] * momentum, -change]);
  }
  let air = unrotate(quaternion, subtract(state.velocity, wind));
  if (plant.centre_of_mass) air = add(air, cross(plant.centre_of_mass, rate));
  const drag = air.map((v, i) => -v * (plant.drag_linear[i] + Math.abs(v) * plant.drag_quadratic[i]));
  if (plant.centre_of_mass) torque = add(torque, cross(drag, plant.centre_of_mass));
  if (plant.drag_torque) torque = subtract(torque, times(plant.drag_torque, rate));
  const collective = thrust.reduce((sum, f) => sum + f, 0);
  const push = rotate(quaternion, add(drag, [0, 0, collective]));
  const left = subtract(torque, gyroscopicTorque(plant, rate));
  return {
    linear: subtract(scale(push, 1 / plant.mass), [0, 0, GRAVITY]),
    angular: tensorTimes(plant.mobility.diagonal, plant.mobility.products, left),
  };
}
