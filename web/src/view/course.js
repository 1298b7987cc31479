// What a task has in space: gates, a pad, a slit in a wall, a target, a reference.
import * as THREE from "three";
import { lookAt } from "../tasks/hover_aware.js";
import { durationOf, pointOf } from "../tasks/track.js";
import { FRAME } from "../tasks/verdicts.js";
import { WALL_WIDTH } from "../tasks/gap.js";
import { surface } from "./colours.js";

/** @typedef {Record<string, THREE.Color>} Colours */
/** @typedef {(world: any) => void} Update What moves or changes its colour with the flight. */
/** @typedef {(group: THREE.Group, world: any, colour: Colours) => Update | void} Draw */

const DEPTH = 0.06;

/** The things of a course. @type {(world: any, colour: Colours) => {group: THREE.Group, update: Update}} */
export function courseOf(world, colour) {
  const group = new THREE.Group();
  const update = DRAW[world.course.kind](group, world, colour) ?? (() => {});
  group.traverse((part) => {
    part.castShadow ||= part instanceof THREE.Mesh && !part.userData.light;
  });
  return { group, update };
}

/** Something that casts no shadow. @type {(mesh: THREE.Mesh) => THREE.Mesh} */
function light(mesh) {
  mesh.userData.light = true;
  return mesh;
}

/** @type {(group: THREE.Group, gates: any, count: number, colour: Colours) => (next: number) => void} */
function drawGates(group, gates, count, colour) {
  const materials = Array.from({ length: count }, (_, g) => {
    const material = surface(colour.gate);
    const [wide, high] = gates.half[g];
    const frame = new THREE.Group();
    for (const [y, z, width, height] of [
      [wide + FRAME / 2, 0, FRAME, 2 * high],
      [-wide - FRAME / 2, 0, FRAME, 2 * high],
      [0, high + FRAME / 2, 2 * (wide + FRAME), FRAME],
      [0, -high - FRAME / 2, 2 * (wide + FRAME), FRAME],
    ]) {
      const bar = new THREE.Mesh(new THREE.BoxGeometry(DEPTH, width, height), material);
      bar.position.set(0, y, z);
      frame.add(bar);
    }
    const [x, y, z] = gates.position[g];
    const foot = z - high - FRAME;
    if (foot > 0.02) {
      const pole = new THREE.Mesh(new THREE.CylinderGeometry(0.02, 0.02, foot, 8), surface(colour.gate));
      pole.rotation.x = Math.PI / 2;
      pole.position.set(0, 0, -high - FRAME - foot / 2);
      frame.add(pole);
    }
    const label = text(`${g + 1}`, colour.gate);
    label.position.set(0, 0, high + 0.38);
    frame.add(label);
    frame.position.set(x, y, z);
    frame.rotation.z = Math.atan2(gates.sin[g], gates.cos[g]);
    group.add(frame);
    return material;
  });
  return (next) => {
    for (const [g, material] of materials.entries()) {
      material.color.copy(g === next ? colour.next : colour.gate);
      material.emissive.copy(material.color).multiplyScalar(g === next ? 0.35 : 0.05);
    }
  };
}

/** @type {(words: string, colour: THREE.Color) => THREE.Sprite} */
function text(words, colour) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 128;
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.font = "bold 88px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillStyle = `#${colour.getHexString()}`;
  pen.fillText(words, 64, 68);
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map, depthWrite: false }));
  sprite.scale.setScalar(0.45);
  return sprite;
}

/** A ring about a point, its plane level. @type {(radius: number, width: number, colour: THREE.Color) => THREE.Mesh} */
const ring = (radius, width, colour) =>
  light(new THREE.Mesh(new THREE.TorusGeometry(radius, width, 12, 64), new THREE.MeshBasicMaterial({ color: colour })));

/** A target, the ring within which it counts as reached, and the plumb line to the ground.
 * @type {(group: THREE.Group, config: any, colour: Colours) => void} */
function drawTarget(group, config, colour) {
  const [x, y, z] = config.target;
  const ball = light(
    new THREE.Mesh(new THREE.SphereGeometry(0.03, 24, 16), new THREE.MeshBasicMaterial({ color: colour.target })),
  );
  const sphere = light(
    new THREE.Mesh(
      new THREE.SphereGeometry(config.radius, 24, 16),
      new THREE.MeshBasicMaterial({ color: colour.target, transparent: true, opacity: 0.18, depthWrite: false }),
    ),
  );
  const circle = ring(config.radius, 0.006, colour.target);
  for (const part of [ball, sphere, circle]) part.position.set(x, y, z);
  const points = [new THREE.Vector3(x, y, 0), new THREE.Vector3(x, y, z)];
  const plumb = new THREE.Line(
    new THREE.BufferGeometry().setFromPoints(points),
    new THREE.LineDashedMaterial({ color: colour.target, dashSize: 0.08, gapSize: 0.08, transparent: true, opacity: 0.6 }),
  );
  plumb.computeLineDistances();
  const shadow = ring(config.radius, 0.008, colour.target);
  shadow.position.set(x, y, 0.005);
  group.add(ball, sphere, circle, plumb, shadow);
}

/** By kind of task. @type {Record<string, Draw>} */
const DRAW = {
  hover: (group, world, colour) => drawTarget(group, world.course.task.config, colour),

  hover_aware(group, world, colour) {
    const { config } = world.course.task;
    drawTarget(group, config, colour);
    const ball = new THREE.Mesh(new THREE.SphereGeometry(config.size, 32, 24), surface(colour.next));
    const sight = new THREE.Line(
      new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]),
      new THREE.LineBasicMaterial({ color: colour.next, transparent: true, opacity: 0.5 }),
    );
    sight.frustumCulled = false;
    group.add(ball, sight);
    return ({ memory, time, vehicle }) => {
      const [x, y, z] = lookAt(memory, time);
      ball.position.set(x, y, z);
      const ends = sight.geometry.attributes.position;
      ends.setXYZ(0, vehicle.position[0], vehicle.position[1], vehicle.position[2]);
      ends.setXYZ(1, x, y, z);
      ends.needsUpdate = true;
    };
  },

  land(group, world, colour) {
    const { radius } = world.course.task.config;
    const pad = new THREE.Mesh(new THREE.CircleGeometry(3 * radius, 64), surface(colour.body));
    pad.receiveShadow = true;
    pad.position.z = 0.002;
    const inner = light(
      new THREE.Mesh(new THREE.CircleGeometry(radius, 48), new THREE.MeshBasicMaterial({ color: colour.target })),
    );
    inner.position.z = 0.006;
    const rim = ring(3 * radius, 0.012, colour.target);
    group.add(light(pad), inner, rim);
  },

  track(group, world, colour) {
    const { reference } = world.memory;
    const duration = Math.min(durationOf(reference), world.course.task.config.episode_s);
    const points = Array.from({ length: 241 }, (_, i) => {
      const [x, y, z] = pointOf(reference, (duration * i) / 240);
      return new THREE.Vector3(x, y, z);
    });
    const tube = new THREE.TubeGeometry(new THREE.CatmullRomCurve3(points), 480, 0.012, 8);
    const paint = new THREE.MeshBasicMaterial({ color: colour.target, transparent: true, opacity: 0.55 });
    const now = new THREE.Mesh(new THREE.SphereGeometry(0.06, 24, 16), surface(colour.next));
    group.add(light(new THREE.Mesh(tube, paint)), now);
    return ({ memory, time }) => {
      const [x, y, z] = pointOf(memory.reference, time);
      now.position.set(x, y, z);
    };
  },

  race(group, world, colour) {
    const { gates } = world.course.task;
    const show = drawGates(group, gates, gates.cos.length, colour);
    return ({ memory }) => show(memory % gates.cos.length);
  },

  any_race(group, world, colour) {
    const { gates, count } = world.memory.tracks;
    const show = drawGates(group, gates, count, colour);
    return ({ memory }) => show(memory.passed % count);
  },

  gap(group, world, colour) {
    const { opening, thickness } = world.course.task.config;
    const [y, z] = opening.map((/** @type {number} */ x) => x / 2);
    const rectangle = (/** @type {number} */ a, /** @type {number} */ b) =>
      [[-a, -b], [a, -b], [a, b], [-a, b]].map(([u, v]) => new THREE.Vector2(u, v));
    const outline = new THREE.Shape(rectangle(y + WALL_WIDTH, z + WALL_WIDTH));
    outline.holes.push(new THREE.Path(rectangle(y, z)));
    const solid = new THREE.ExtrudeGeometry(outline, { depth: thickness, bevelEnabled: false });
    solid.translate(0, 0, -thickness / 2);
    // the shape lies in x and y and is thick along z: to y, z and x of the slit's frame
    solid.applyMatrix4(new THREE.Matrix4().set(0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1));
    const wall = new THREE.Group();
    const see = { transparent: true, opacity: 0.42, side: THREE.DoubleSide, depthWrite: false };
    const edge = rectangle(y, z).map((p) => new THREE.Vector3(0, p.x, p.y));
    const frame = new THREE.TubeGeometry(new THREE.CatmullRomCurve3(edge, true, "catmullrom", 0), 128, 0.012, 8, true);
    wall.add(
      light(new THREE.Mesh(solid, surface(colour.wall, see))),
      light(new THREE.Mesh(frame, new THREE.MeshBasicMaterial({ color: colour.next }))),
    );
    const [w, a, b, c] = world.memory.quaternion;
    wall.quaternion.set(a, b, c, w);
    wall.position.set(world.memory.centre[0], world.memory.centre[1], world.memory.centre[2]);
    group.add(wall);
  },
};

/** The box in which a course lies, from where its vehicle starts. @type {(world: any) => THREE.Box3} */
export function extent(world) {
  const { kind, task } = world.course;
  const { memory } = world;
  const places = [world.vehicle.position];
  if (kind === "hover" || kind === "hover_aware") places.push(task.config.target);
  if (kind === "hover_aware") places.push(lookAt(memory, 0));
  if (kind === "land") places.push([0, 0, 0]);
  if (kind === "gap") places.push(memory.centre);
  if (kind === "race") places.push(...task.gates.position.slice(0, -1));
  if (kind === "any_race") places.push(...memory.tracks.gates.position.slice(0, memory.tracks.count));
  if (kind === "track") for (let t = 0; t < 10; t += 0.25) places.push(pointOf(memory.reference, t));
  const box = new THREE.Box3();
  for (const [x, y, z] of places) box.expandByPoint(new THREE.Vector3(x, y, z));
  return box.expandByScalar(0.4);
}
