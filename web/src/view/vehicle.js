// A quadrotor from the numbers of its file: where its rotors are, how high it stands, which way they turn.
import * as THREE from "three";
import { surface } from "./colours.js";

/** Turns of a drawn rotor for one of the real: so slow that the eye sees it turn. */
const SLOWED = 0.012;

export class Vehicle {
  /** @param {any} numbers of the vehicle @param {Record<string, THREE.Color>} colour */
  constructor(numbers, colour) {
    this.group = new THREE.Group();
    this.spin = numbers.rotor_spin;
    /** @type {THREE.Group[]} */
    this.rotors = [];
    const arm = Math.max(...numbers.rotor_position.map((/** @type {number[]} */ p) => Math.hypot(p[0], p[1])));
    const feet = numbers.feet_height;
    const shell = surface(colour.body);
    const hull = new THREE.Mesh(new THREE.BoxGeometry(0.95 * arm, 0.5 * arm, 0.28 * arm), shell);
    const nose = new THREE.Mesh(new THREE.SphereGeometry(0.12 * arm, 16, 12), surface(colour.front));
    nose.position.set(0.5 * arm, 0, 0.02 * arm);
    this.group.add(hull, nose);
    for (const [i, [x, y]] of numbers.rotor_position.entries()) {
      const angle = Math.atan2(y, x);
      const beam = new THREE.Mesh(new THREE.BoxGeometry(Math.hypot(x, y), 0.11 * arm, 0.07 * arm), shell);
      beam.position.set(x / 2, y / 2, 0);
      beam.rotation.z = angle;
      const motor = new THREE.Mesh(new THREE.CylinderGeometry(0.11 * arm, 0.11 * arm, 0.22 * arm, 16), shell);
      motor.rotation.x = Math.PI / 2;
      motor.position.set(x, y, 0.07 * arm);
      const leg = new THREE.Mesh(new THREE.CylinderGeometry(0.035 * arm, 0.03 * arm, feet, 8), shell);
      leg.rotation.x = Math.PI / 2;
      leg.position.set(x, y, -feet / 2);
      const rotor = this.#rotor(0.55 * arm, x > 0 ? colour.front : colour.rear);
      rotor.position.set(x, y, 0.2 * arm);
      rotor.rotation.z = i;
      this.rotors.push(rotor);
      this.group.add(beam, motor, leg, rotor);
    }
    this.group.traverse((part) => {
      part.castShadow = true;
    });
  }

  /** @param {number} radius @param {THREE.Color} colour */
  #rotor(radius, colour) {
    const rotor = new THREE.Group();
    const blade = new THREE.BoxGeometry(2 * radius, 0.16 * radius, 0.03 * radius);
    const disc = new THREE.Mesh(
      new THREE.CircleGeometry(radius, 32),
      new THREE.MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.28, side: THREE.DoubleSide, depthWrite: false }),
    );
    rotor.add(new THREE.Mesh(blade, surface(colour)), disc);
    return rotor;
  }

  /** @param {any} state @param {number} dt s since the last picture */
  place(state, dt) {
    const [w, x, y, z] = state.quaternion;
    this.group.position.set(state.position[0], state.position[1], state.position[2]);
    this.group.quaternion.set(x, y, z, w);
    for (const [i, rotor] of this.rotors.entries()) {
      rotor.rotation.z -= this.spin[i] * state.rotor_speed[i] * SLOWED * dt;
    }
  }
}

/** The state between two, for a picture at a share of the way. @type {(a: any, b: any, share: number) => any} */
export function between(a, b, share) {
  const mix = (/** @type {number[]} */ p, /** @type {number[]} */ q) => p.map((x, i) => x + share * (q[i] - x));
  const [from, to] = [a.quaternion, b.quaternion].map(([w, x, y, z]) => new THREE.Quaternion(x, y, z, w));
  const q = from.slerp(to, share);
  return {
    position: mix(a.position, b.position),
    velocity: mix(a.velocity, b.velocity),
    rotor_speed: mix(a.rotor_speed, b.rotor_speed),
    quaternion: [q.w, q.x, q.y, q.z],
  };
}

