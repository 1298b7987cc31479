// What a visitor reads and moves: figures, verdict, sliders, buttons.
import { LATEST } from "../simulation/environment.js";
import { norm } from "../simulation/vectors.js";
import { TASKS } from "../tasks/index.js";

/** @typedef {import("../simulation/environment.js").Conditions} Conditions */

/** An element of the page by its id. @type {(id: string) => any} */
export const element = (id) => document.getElementById(id);

/** Of tasks, for people. @type {Record<string, string>} */
const TITLES = {
  hover: "Hover",
  hover_aware: "Hover and look at a ball",
  land: "Land on a pad",
  track: "Follow a reference",
  race: "Race through gates",
  any_race: "Race through gates",
  gap: "Fly through a slit",
};
const SLIDERS = ["wind", "direction", "mass", "delay"];

/** Fill in what does not change. @type {(flight: any) => void} */
export function describe(flight) {
  const title = TITLES[flight.courses[0].kind];
  document.title = `${title}: ${flight.vehicle}, e2efly`;
  element("title").textContent = title;
  const trained = flight.vehicle === flight.trained_on ? "" : `, policy of ${flight.trained_on}`;
  element("vehicle").textContent = `${flight.vehicle}${trained}, ${Math.round(1 / flight.physics.control_period)} Hz`;
  const delay = element("delay");
  delay.max = Math.round(1e3 * Math.max(LATEST, flight.latency));
  delay.value = delay.defaultValue = Math.round(1e3 * flight.latency);
  const courses = element("course");
  for (const [i, course] of flight.courses.entries()) courses.append(new Option(course.name, `${i}`));
  element("courses").hidden = flight.courses.length === 1;
  element("gates-row").hidden = TASKS[flight.courses[0].kind].progress === undefined;
  element("error-row").hidden = TASKS[flight.courses[0].kind].progress !== undefined;
  // a race is longer than what a screen shows of a vehicle of its size
  element("camera").value = TASKS[flight.courses[0].kind].progress ? "follow" : "orbit";
  showSliders();
}

/** What the sliders say. @type {(flight: any) => Conditions} */
export function conditionsOf(flight) {
  const angle = (Math.PI / 180) * element("direction").valueAsNumber;
  const speed = element("wind").valueAsNumber;
  const delay = element("delay");
  return {
    wind: [speed * Math.cos(angle), speed * Math.sin(angle), 0],
    mass: element("mass").valueAsNumber,
    delay: delay.value === delay.defaultValue ? flight.latency : delay.valueAsNumber / 1e3,
  };
}

/** Their values beside them. */
export function showSliders() {
  const text = {
    wind: `${element("wind").valueAsNumber.toFixed(1)} m/s`,
    direction: `${element("direction").value}°`,
    mass: `×${element("mass").valueAsNumber.toFixed(2)}`,
    delay: `${element("delay").value} ms`,
  };
  for (const [name, words] of Object.entries(text)) element(`${name}-value`).textContent = words;
  element("nominal").disabled = SLIDERS.every((name) => element(name).value === element(name).defaultValue);
}

/** All sliders as they were. */
export function resetSliders() {
  for (const name of SLIDERS) element(name).value = element(name).defaultValue;
  showSliders();
}

/** The figures of an episode. @type {(episode: import("../flights.js").Episode, paused: boolean) => void} */
export function report({ world, outcome, verdict }, paused) {
  const task = TASKS[world.course.kind];
  element("time").textContent = `${world.time.toFixed(1)} s`;
  element("speed").textContent = `${norm(world.vehicle.velocity).toFixed(1)} m/s`;
  element("error").textContent = outcome ? `${outcome.error.toFixed(2)} m` : "";
  element("gates").textContent = task.progress?.(world.course.task, world.memory) ?? "";
  const status = element("status");
  const [kind, words] = told(verdict, paused);
  status.className = kind;
  if (status.textContent !== words) status.textContent = words;
}

/** @type {(verdict: import("../simulation/environment.js").Outcome | null, paused: boolean) => [string, string]} */
function told(verdict, paused) {
  if (verdict?.success) return ["good", "success"];
  if (verdict) return ["bad", verdict.why || "time is out"];
  return ["", paused ? "paused" : "flying"];
}
