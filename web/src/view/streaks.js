// The trail of the vehicle, and streaks that drift with the wind.
import * as THREE from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";

const POINTS = 240;
const STREAKS = 90;
const BOX = 8;

/** Where the vehicle has been, fading. */
export class Trail {
  /** @param {Record<string, THREE.Color>} colour */
  constructor(colour) {
    this.colour = colour;
    /** @type {number[][]} */
    this.points = [];
    this.line = new Line2(new LineGeometry(), new LineMaterial({ linewidth: 3, vertexColors: true }));
    this.line.frustumCulled = false;
    this.line.visible = false;
  }

  clear() {
    this.points = [];
    this.line.visible = false;
  }

  /** @param {number[]} point */
  add(point) {
    this.points.push(point);
    if (this.points.length > POINTS) this.points.shift();
    if (this.points.length < 2) return;
    const mixed = new THREE.Color();
    const shades = this.points.flatMap((_, i) => {
      mixed.lerpColors(this.colour.ground, this.colour.trail, i / (this.points.length - 1));
      return [mixed.r, mixed.g, mixed.b];
    });
    this.line.geometry.dispose();
    this.line.geometry = new LineGeometry();
    this.line.geometry.setPositions(this.points.flat());
    this.line.geometry.setColors(shades);
    this.line.visible = true;
  }
}

/** Streaks in a box about a point, as long as the air moves in a tenth of a second. */
export class Streaks {
  /** @param {Record<string, THREE.Color>} colour */
  constructor(colour) {
    const paint = new THREE.LineBasicMaterial({ color: colour.wind, transparent: true, opacity: 0.55 });
    this.places = Array.from({ length: STREAKS }, () => [0, 0, 0].map(() => BOX * (Math.random() - 0.5)));
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(6 * STREAKS), 3));
    this.lines = new THREE.LineSegments(this.geometry, paint);
    this.lines.frustumCulled = false;
  }

  /** @param {number[]} wind world, m/s @param {number[]} about @param {number} dt s */
  move(wind, about, dt) {
    this.lines.visible = wind.some((x) => x !== 0);
    if (!this.lines.visible) return;
    const ends = this.geometry.attributes.position;
    for (const [i, place] of this.places.entries()) {
      for (const k of [0, 1, 2]) {
        place[k] += wind[k] * dt;
        const off = place[k] - about[k];
        if (Math.abs(off) > BOX / 2) place[k] -= BOX * Math.round(off / BOX);
      }
      const z = Math.abs(place[2]) + 0.05;
      ends.setXYZ(2 * i, place[0], place[1], z);
      ends.setXYZ(2 * i + 1, place[0] - 0.1 * wind[0], place[1] - 0.1 * wind[1], z);
    }
    ends.needsUpdate = true;
  }
}
