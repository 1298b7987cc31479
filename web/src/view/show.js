// Draws a flight, picture after picture.
import * as THREE from "three";
import { colours } from "./colours.js";
import { courseOf, extent } from "./course.js";
import { Stage } from "./stage.js";
import { Streaks, Trail } from "./streaks.js";
import { between, Vehicle } from "./vehicle.js";

/** Length of a course, m, from which on the camera follows the vehicle at first. */
const LONG = 10;

/** Take things out of the scene, and their memory from the graphics card. @type {(things: THREE.Object3D) => void} */
function discard(things) {
  things.removeFromParent();
  things.traverse((/** @type {any} */ part) => {
    part.geometry?.dispose();
    part.material?.map?.dispose();
    part.material?.dispose();
  });
}

export class Show {
  /** @param {HTMLCanvasElement} canvas @param {any} flight */
  constructor(canvas, flight) {
    this.flight = flight;
    this.stage = new Stage(canvas, colours());
    /** @type {Vehicle[]} */
    this.vehicles = [];
    /** @type {Trail[]} One for each vehicle. */
    this.trails = [];
    /** @type {any} The start that is drawn. */
    this.drawn = null;
    this.paint();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.paint());
  }

  /** All things anew, in the colours of now. */
  paint() {
    const colour = colours();
    const gone = [...this.vehicles.map((one) => one.group), ...this.trails.map((trail) => trail.line)];
    for (const part of [...gone, this.streaks?.lines, this.course?.group]) {
      if (part) discard(part);
    }
    this.stage.paint(colour);
    const { agents, vehicle } = this.flight.courses[0];
    this.vehicles = Array.from({ length: agents }, () => new Vehicle(vehicle, colour));
    this.trails = this.vehicles.map(() => new Trail(colour));
    this.streaks = new Streaks(colour);
    this.course = null;
    for (const [i, { group }] of this.vehicles.entries()) this.stage.scene.add(group, this.trails[i].line);
    this.stage.scene.add(this.streaks.lines);
  }

  /** @param {any} world at the start of an episode: its course is drawn, and where the course is another, looked at */
  begin(world) {
    const colour = colours();
    if (this.course) discard(this.course.group);
    this.course = courseOf(world, colour);
    this.stage.scene.add(this.course.group);
    if (this.drawn?.course !== world.course) this.stage.frame(extent(world));
    this.drawn = world;
    for (const trail of this.trails) trail.clear();
    this.stage.stale = true;
  }

  /** @param {any} world @returns {boolean} whether its course is long */
  isLong(world) {
    return extent(world).getSize(new THREE.Vector3()).length() > LONG;
  }

  /** @param {any} world that the drawn vehicles leave behind them */
  reached(world) {
    for (const [i, trail] of this.trails.entries()) trail.add(world.vehicles[i].position);
  }

  /** One picture.
   * @param {any} before @param {any} world @param {number} share of the way between the two
   * @param {{dt: number, wind: number[], camera: string, moves: boolean}} how seconds since the last picture; the wind;
   *   what the camera does; whether anything moves but the camera */
  draw(before, world, share, { dt, wind, camera, moves }) {
    if (!this.course) this.begin(this.drawn ?? world);
    const states = this.vehicles.map((_, i) => between(before.vehicles[i], world.vehicles[i], share));
    for (const [i, vehicle] of this.vehicles.entries()) vehicle.place(states[i], moves ? dt : 0);
    const [state] = states;
    this.course?.update(world);
    const [w, x, y, z] = state.quaternion;
    const place = new THREE.Vector3(state.position[0], state.position[1], state.position[2]);
    this.streaks?.move(wind, state.position, moves ? dt : 0);
    this.stage.orbit.enabled = camera !== "ride";
    if (camera === "ride") this.stage.ride(place, new THREE.Quaternion(x, y, z, w));
    else {
      if (camera === "follow") this.stage.follow(place);
      this.stage.orbit.update();
    }
    if (moves || this.stage.stale) this.stage.draw(place);
  }

  /** The camera goes with the first vehicle, near it; or looks at the whole course again. @param {string} camera @param {any} world */
  look(camera, world) {
    this.stage.stale = true;
    if (camera === "orbit") this.stage.frame(extent(this.drawn));
    if (camera === "follow") {
      const [x, y, z] = world.vehicles[0].position;
      this.stage.orbit.target.set(x, y, z);
      this.stage.camera.position.set(x - 2.2, y - 2.2, z + 1.3);
    }
  }
}
