// Sky, ground, lights, and what the camera does.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const REACH = 60;

/** The ground: squares of a metre. @type {(colour: Record<string, THREE.Color>) => THREE.Texture} */
function squares(colour) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 256;
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.fillStyle = `#${colour.ground.getHexString()}`;
  pen.fillRect(0, 0, 256, 256);
  pen.strokeStyle = `#${colour.grid.getHexString()}`;
  pen.lineWidth = 4;
  pen.strokeRect(0, 0, 256, 256);
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  map.wrapS = map.wrapT = THREE.RepeatWrapping;
  map.repeat.set(2 * REACH, 2 * REACH);
  map.anisotropy = 8;
  return map;
}

/** A renderer, its scene and its camera in an element that fills the page. */
export class Stage {
  /** @param {HTMLCanvasElement} canvas @param {Record<string, THREE.Color>} colour */
  constructor(canvas, colour) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.05, 150);
    this.camera.up.set(0, 0, 1);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.enableDamping = true;
    /** Whether the last picture is no longer what there is to see. */
    this.stale = true;
    this.orbit.addEventListener("change", () => {
      this.stale = true;
    });
    this.orbit.maxPolarAngle = Math.PI / 2 - 0.02;
    this.orbit.minDistance = 0.5;
    this.orbit.maxDistance = 40;
    this.sun = new THREE.DirectionalLight(0xffffff, 2.2);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(2048, 2048);
    const box = this.sun.shadow.camera;
    [box.left, box.right, box.top, box.bottom, box.near, box.far] = [-9, 9, 9, -9, 1, 60];
    this.scene.add(this.sun, this.sun.target, new THREE.HemisphereLight(0xffffff, 0x667080, 1.6));
    const plane = new THREE.PlaneGeometry(2 * REACH, 2 * REACH);
    this.ground = new THREE.Mesh(plane, new THREE.MeshLambertMaterial());
    this.ground.receiveShadow = true;
    this.scene.add(this.ground);
    this.paint(colour);
    new ResizeObserver(() => this.resize()).observe(/** @type {HTMLElement} */ (canvas.parentElement));
    this.resize();
  }

  /** @param {Record<string, THREE.Color>} colour */
  paint(colour) {
    this.scene.background = colour.sky;
    this.scene.fog = new THREE.Fog(colour.sky, 18, REACH);
    this.ground.material.map?.dispose();
    this.ground.material.map = squares(colour);
    this.ground.material.needsUpdate = true;
    this.stale = true;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = /** @type {HTMLElement} */ (
      this.renderer.domElement.parentElement
    );
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
    this.stale = true;
  }

  /** See all of a course from a corner. @param {THREE.Box3} box */
  frame(box) {
    const sphere = box.getBoundingSphere(new THREE.Sphere());
    const wide = Math.min(1, this.camera.aspect);
    const away = Math.max(sphere.radius, 1.2) / Math.sin((this.camera.fov * Math.PI) / 360) / wide;
    this.orbit.target.copy(sphere.center);
    const direction = new THREE.Vector3(-0.72, -0.72, 0.42).normalize();
    this.camera.position.copy(sphere.center).addScaledVector(direction, Math.min(away, 36));
    this.orbit.update();
  }

  /** Move the camera's target, and the camera with it. @param {THREE.Vector3} point */
  follow(point) {
    this.camera.position.add(point).sub(this.orbit.target);
    this.orbit.target.copy(point);
  }

  /** Look from a pose of the vehicle, ahead and slightly down. @param {THREE.Vector3} place @param {THREE.Quaternion} q */
  ride(place, q) {
    this.camera.position.copy(place).add(new THREE.Vector3(0.05, 0, 0.04).applyQuaternion(q));
    this.camera.up.set(0, 0, 1).applyQuaternion(q);
    this.camera.lookAt(this.camera.position.clone().add(new THREE.Vector3(1, 0, 0.1).applyQuaternion(q)));
    this.camera.up.set(0, 0, 1);
  }

  /** @param {THREE.Vector3} middle of what is to have a shadow */
  draw(middle) {
    this.sun.target.position.copy(middle).setZ(0);
    this.sun.position.copy(this.sun.target.position).add(new THREE.Vector3(-6, -4, 18));
    this.renderer.render(this.scene, this.camera);
    this.stale = false;
  }
}
