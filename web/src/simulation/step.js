// One control step: physics sub-steps under the commands that act, the rate loop at each (e2efly/physics/step.py).
import { gyroscopicTorque, plantOf, powered, rotorSpeeds, tensorTimes } from "./body.js";
import { CONTROLLERS, rotorThrusts } from "./cascade.js";
import { INTEGRATORS } from "./integrate.js";
import { add, clamp, clip, scale, subtract, times } from "./vectors.js";

const RATE_LOOP = ["rate_gain", "rate_integral_gain", "gyro_time_constant"];

/** @typedef {{old: number[], next: number[], switched: number}} Acting
 * The command that acts until `switched` s after the start of the period, and the one that acts then. */

/** The state a control period later.
 * @param {any} physics as exported
 * @param {any} body the numbers of what flies
 * @param {any} state where it starts
 * @param {Acting} acting the commands
 * @param {number[]} wind world, m/s */
export function step(physics, body, state, acting, wind) {
  const dt = physics.control_period / physics.substeps;
  const plant = plantOf(body, dt);
  const controller = { ...physics.nominal };
  for (const name of RATE_LOOP) controller[name] = body[name];
  const integrate = INTEGRATORS[physics.integrator];
  for (let i = 0; i < physics.substeps; i++) {
    const share = clamp(i + 1 - acting.switched / dt, 0, 1);
    const command = add(acting.old, scale(subtract(acting.next, acting.old), share));
    const told = rotorCommand(physics, controller, state, command, dt);
    const speed = physics.full_speed === null ? told.speed : told.speed.map((w) => Math.min(w, physics.full_speed));
    const reached = integrate(plant, state, powered(plant, state.rotor_speed, speed), wind, dt);
    state = { ...reached, rate_loop: told.loop };
  }
  return state;
}

/** Rotor speed commands, rad/s, and what the rate loop remembers (e2efly/physics/control.py).
 * @type {(physics: any, vehicle: any, state: any, command: number[], dt: number) => {speed: number[], loop: any}} */
function rotorCommand(physics, vehicle, state, command, dt) {
  const { mixer, command_mode: mode } = physics;
  const controller = CONTROLLERS[mode];
  if (controller === null) {
    const thrust = mode === "rotor_share" ? scale(command, mixer.thrust_max) : command;
    const limited = thrust.map((f) => clamp(f, mixer.thrust_min, mixer.thrust_max));
    return { speed: rotorSpeeds(vehicle, limited), loop: null };
  }
  const wanted = controller(vehicle, state, command);
  let rate = state.body_rate;
  /** @type {any} */
  let loop = null;
  if (state.rate_loop !== null) {
    const { seen, integral } = state.rate_loop;
    if (seen !== null) rate = add(rate, scale(subtract(seen, rate), Math.exp(-dt / vehicle.gyro_time_constant)));
    loop = { seen: seen === null ? null : rate, integral };
    if (integral !== null) {
      const change = scale(times(vehicle.rate_integral_gain, subtract(wanted.rate, rate)), dt);
      loop.integral = clip(add(integral, change), times(vehicle.rate_gain, vehicle.body_rate_max));
    }
  }
  const { inertia, inertia_products: products } = vehicle;
  const turned = times(vehicle.rate_gain, subtract(wanted.rate, rate));
  const pushed = loop !== null && loop.integral !== null ? add(turned, loop.integral) : turned;
  const torque = add(tensorTimes(inertia, products, pushed), gyroscopicTorque(vehicle, rate));
  return { speed: rotorSpeeds(vehicle, rotorThrusts(mixer, vehicle.mass * wanted.thrust, torque)), loop };
}
