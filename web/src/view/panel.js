// What a visitor reads and moves: figures, verdict, sliders, buttons.
/** @typedef {import("../flights.js").Conditions} Conditions */

/** An element of the page by its id. @type {(id: string) => any} */
export const element = (id) => document.getElementById(id);

const SLIDERS = ["wind", "direction", "mass", "thrust", "delay"];

/** Fill in what does not change. @type {(flight: any) => void} */
export function describe(flight) {
  const { agents, period, latency, latest } = flight.courses[0];
  const words = flight.task.replaceAll("_", " ");
  const title = words.slice(0, 1).toUpperCase() + words.slice(1);
  document.title = `${title}: ${flight.vehicle}, e2efly`;
  element("title").textContent = title;
  const trained = flight.vehicle === flight.trained_on ? "" : `, policy of ${flight.trained_on}`;
  const count = agents > 1 ? `${agents} × ` : "";
  element("vehicle").textContent = `${count}${flight.vehicle}${trained}, ${Math.round(1 / period)} Hz`;
  const delay = element("delay");
  delay.max = Math.round(1e3 * Math.max(latest, latency));
  delay.value = delay.defaultValue = Math.round(1e3 * latency);
  const courses = element("course");
  for (const [i, course] of flight.courses.entries()) courses.append(new Option(course.name, `${i}`));
  element("courses").hidden = flight.courses.length === 1;
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
    thrust: element("thrust").valueAsNumber,
    delay: delay.value === delay.defaultValue ? flight.courses[0].latency : delay.valueAsNumber / 1e3,
  };
}

/** Their values beside them. */
export function showSliders() {
  const text = {
    wind: `${element("wind").valueAsNumber.toFixed(1)} m/s`,
    direction: `${element("direction").value}°`,
    mass: `×${element("mass").valueAsNumber.toFixed(2)}`,
    thrust: `×${element("thrust").valueAsNumber.toFixed(2)}`,
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

/** The figures of an episode: of several vehicles, those of the first. @type {(episode: import("../flights.js").Episode, paused: boolean) => void} */
export function report({ world, arrivals, outcome, verdict }, paused) {
  element("time").textContent = `${world.time.toFixed(1)} s`;
  element("speed").textContent = `${Math.hypot(...world.vehicles[0].velocity).toFixed(1)} m/s`;
  element("error").textContent = outcome ? `${outcome.error.toFixed(2)} m` : "";
  element("arrivals").textContent = `${arrivals}`;
  const status = element("status");
  const [kind, words] = told(verdict, paused);
  status.className = kind;
  if (status.textContent !== words) status.textContent = words;
}

/** @type {(verdict: import("../flights.js").Outcome | null, paused: boolean) => [string, string]} */
function told(verdict, paused) {
  if (verdict?.success) return ["good", "success"];
  if (verdict?.terminated) return ["bad", ["failed", verdict.signals.join(", ")].filter(Boolean).join(": ")];
  if (verdict) return ["bad", "time is out"];
  return ["", paused ? "paused" : "flying"];
}
