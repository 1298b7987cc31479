// What a task has in space: its solids, its lines and faces, and where the vehicles are to be.
import * as THREE from "three";
import { bytesOf } from "../machine.js";
import { surface } from "./colours.js";

/** @typedef {Record<string, THREE.Color>} Colours */
/** @typedef {import("../flights.js").World} World */

/** Distance, m, within which a solid stands around the goal and is shown as the next one. */
const AROUND = 0.05;
/** How a wall is painted, so that it does not hide the flight. */
const SEEN_THROUGH = { transparent: true, opacity: 0.42, side: THREE.DoubleSide, depthWrite: false };

/** The things of a course.
 * @type {(world: World, colour: Colours) => {group: THREE.Group, update: (world: World) => void}} */
export function courseOf(world, colour) {
  const { solids, lines, faces, marks } = world.course.scenes[world.start.scene];
  const group = new THREE.Group();
  const standing = solids.map((/** @type {any} */ solid) => drawn(solid, colour));
  for (const { mesh } of standing) group.add(mesh);
  for (const points of lines) group.add(tube(points, colour.target));
  for (const points of faces) group.add(face(points, colour.target));
  for (const { point, text } of marks) group.add(label(text, point, colour.gate));
  const light = new THREE.MeshBasicMaterial({ color: colour.next, transparent: true, opacity: 0.7 });
  const goals = world.goals.map(() => new THREE.Mesh(new THREE.SphereGeometry(0.03, 24, 16), light));
  group.add(...goals);
  return {
    group,
    update({ time, goals: places }) {
      for (const [i, goal] of goals.entries()) {
        const [x, y, z] = places[i];
        goal.position.set(x, y, z);
        goal.visible = true;
      }
      for (const solid of standing) {
        if (solid.path) solid.mesh.position.copy(solid.path(time));
        const inside = goals.filter((goal) => !solid.isWall && solid.middle.distanceTo(goal.position) < AROUND);
        const next = inside.length > 0;
        solid.mesh.material.color.copy(next ? colour.next : solid.paint);
        solid.mesh.material.emissive.copy(solid.mesh.material.color).multiplyScalar(next ? 0.35 : 0.05);
        for (const goal of inside) goal.visible = false;
      }
    },
  };
}

/** A solid of four-cornered faces, in the page's colour of what it is, or else in its own.
 * @type {(solid: any, colours: Colours) => any} */
function drawn({ quads, colour, label, path, rate }, colours) {
  const corners = new THREE.BufferAttribute(new Float32Array(bytesOf(quads)), 3);
  const order = Array.from({ length: corners.count / 4 }, (_, i) => [0, 1, 2, 0, 2, 3].map((corner) => 4 * i + corner));
  const geometry = new THREE.BufferGeometry().setAttribute("position", corners).setIndex(order.flat());
  geometry.computeVertexNormals();
  geometry.computeBoundingBox();
  const middle = /** @type {THREE.Box3} */ (geometry.boundingBox).getCenter(new THREE.Vector3());
  const [r, g, b] = colour;
  const paint = colours[label] ?? new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace);
  const isWall = label === "wall";
  const mesh = new THREE.Mesh(geometry, surface(paint, isWall ? SEEN_THROUGH : { side: THREE.DoubleSide }));
  mesh.castShadow = !isWall;
  return { mesh, middle, paint, isWall, path: path && ((/** @type {number} */ time) => moved(path, rate * time)) };
}

/** How far along its closed path something has come since time 0, at an angle, rad. @type {(path: number[][], angle: number) => THREE.Vector3} */
function moved(path, angle) {
  const rounds = path.length - 1;
  const turn = ((angle / (2 * Math.PI)) % 1 + 1) % 1;
  const place = Math.min(Math.floor(turn * rounds), rounds - 1);
  const [first, from, to] = [path[0], path[place], path[place + 1]].map(([x, y, z]) => new THREE.Vector3(x, y, z));
  return from.lerp(to, turn * rounds - place).sub(first);
}

/** @type {(points: number[][], colour: THREE.Color) => THREE.Mesh} */
function tube(points, colour) {
  const curve = new THREE.CatmullRomCurve3(points.map(([x, y, z]) => new THREE.Vector3(x, y, z)));
  const paint = new THREE.MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.55 });
  return new THREE.Mesh(new THREE.TubeGeometry(curve, 2 * points.length, 0.012, 8), paint);
}

/** A flat polygon, just above the ground that it may lie on. @type {(points: number[][], colour: THREE.Color) => THREE.Mesh} */
function face(points, colour) {
  const geometry = new THREE.BufferGeometry().setFromPoints(points.map(([x, y, z]) => new THREE.Vector3(x, y, z + 0.004)));
  geometry.setIndex(points.slice(2).flatMap((_, i) => [0, i + 1, i + 2]));
  return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: colour, side: THREE.DoubleSide }));
}

/** @type {(words: string, point: number[], colour: THREE.Color) => THREE.Sprite} */
function label(words, [x, y, z], colour) {
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
  sprite.position.set(x, y, z);
  return sprite;
}

/** The box in which a course lies, from where its vehicles start. @type {(world: World) => THREE.Box3} */
export function extent(world) {
  const { solids, lines, faces } = world.course.scenes[world.start.scene];
  const around = solids.filter((/** @type {any} */ solid) => solid.label !== "wall");
  const box = new THREE.Box3();
  for (const [x, y, z] of [...world.vehicles.map((one) => one.position), ...world.goals, ...lines.flat(), ...faces.flat()]) {
    box.expandByPoint(new THREE.Vector3(x, y, z));
  }
  for (const solid of around) box.expandByPoint(drawn(solid, {}).middle);
  return box.expandByScalar(0.4);
}
