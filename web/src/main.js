// The page: loads the policy, flies it, shows it.
import { episodeOf, fly, policyOf, stepped, thrown } from "./flights.js";
import { machine } from "./machine.js";
import { conditionsOf, describe, element, report, resetSliders, showSliders } from "./view/panel.js";
import { Show } from "./view/show.js";

/** Longest time between two pictures that is made up for, s: a page that was hidden does not race to catch up. */
const LONGEST = 0.1;
/** How long the end of an episode is shown before the next begins, s. */
const SHOWN = 2.5;

const { e2eflyFlight: flight } = /** @type {any} */ (globalThis);

/** Begin the show, and offer the page's own interface. */
async function begin() {
  describe(flight);
  const act = policyOf(flight);
  const show = showOf();
  let start = 0;
  let paused = new URLSearchParams(location.search).has("paused");
  let episode = episodeOf(flight, 0, 0);
  // a long course is more than what a screen shows of a vehicle of its size
  element("camera").value = show?.isLong(episode.world) ? "follow" : "orbit";
  let camera = element("camera").value;

  const restart = () => {
    start += 1;
    episode = episodeOf(flight, Number(element("course").value), start);
    show?.begin(episode.world);
  };
  const pause = () => {
    paused = !paused;
    element("pause").textContent = paused ? "Go on" : "Pause";
  };
  const toss = () => {
    if (!episode.still) episode = thrown(episode);
  };
  const look = () => {
    camera = element("camera").value;
    show?.look(camera, episode.world);
  };
  /** @type {Record<string, () => void>} */
  const keys = { " ": pause, r: restart, t: toss };
  element("pause").addEventListener("click", pause);
  element("reset").addEventListener("click", restart);
  element("throw").addEventListener("click", toss);
  element("nominal").addEventListener("click", resetSliders);
  element("course").addEventListener("change", restart);
  element("camera").addEventListener("change", look);
  element("sliders").addEventListener("input", showSliders);
  addEventListener("keydown", (event) => {
    // what has the focus keeps the keys that it answers itself
    const own = event.key === " " ? "button, select, summary" : "select";
    if (event.target instanceof Element && event.target.closest(own)) return;
    keys[event.key]?.();
  });
  if (paused) element("pause").textContent = "Go on";

  show?.begin(episode.world);
  show?.look(camera, episode.world);
  let last = performance.now();
  let ahead = 0;
  const picture = () => {
    const now = performance.now();
    const dt = Math.min((now - last) / 1e3, LONGEST);
    last = now;
    ahead += paused ? 0 : dt;
    const conditions = conditionsOf(flight);
    const { period } = episode.world.course;
    for (; ahead >= period; ahead -= period) {
      episode = stepped(episode, act, conditions);
      if (!episode.still) show?.reached(episode.before);
      if (episode.over > SHOWN) restart();
    }
    report(episode, paused);
    const moves = !paused && !episode.still;
    show?.draw(episode.before, episode.world, ahead / period, { dt, wind: conditions.wind, camera, moves });
    requestAnimationFrame(picture);
  };
  requestAnimationFrame(picture);
  element("loading").remove();

  return {
    flight,
    act,
    machine,
    fly: (/** @type {any} */ { actions, numbers = flight, conditions = {}, ...options }) =>
      fly(numbers, actions ? scripted(actions) : act, {
        ...options,
        conditions: { ...conditionsOf(numbers), ...conditions },
      }),
    now: () => ({ time: episode.world.time, ...episode.world.vehicles[0], verdict: episode.verdict }),
  };
}

/** What acts as a policy whose actions are given. @type {(actions: number[][]) => import("./flights.js").Act} */
function scripted(actions) {
  const rest = actions.values();
  return (_, memory) => ({ action: rest.next().value ?? actions[actions.length - 1], memory });
}

/** What draws; null where the browser has no WebGL: then there are figures alone. */
function showOf() {
  try {
    return new Show(element("canvas"), flight);
  } catch (error) {
    console.warn(`no picture: ${error}`);
    element("no-picture").hidden = false;
    return null;
  }
}

/** @type {any} */ (globalThis).e2efly = begin().catch((error) => {
  element("loading").textContent = `The policy cannot fly here: ${error.message ?? error}`;
  throw error;
});
