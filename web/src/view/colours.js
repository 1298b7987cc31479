// The colours of the scene, which follow the page's: light or dark.
import * as THREE from "three";

const NAMES = ["sky", "ground", "grid", "body", "front", "rear", "gate", "next", "target", "trail", "wall", "wind"];

/** As the style sheet has them now. @returns {Record<string, THREE.Color>} */
export function colours() {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(NAMES.map((name) => [name, new THREE.Color(style.getPropertyValue(`--${name}`).trim())]));
}

/** A surface. @type {(colour: THREE.Color, more?: THREE.MeshStandardMaterialParameters) => THREE.MeshStandardMaterial} */
export const surface = (colour, more = {}) =>
  new THREE.MeshStandardMaterial({ color: colour, roughness: 0.65, metalness: 0.05, ...more });
