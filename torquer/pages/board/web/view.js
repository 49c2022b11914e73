// The attitude in 3D: the body at a time, and the way of its axes on a sphere, in inertial axes.

import {
  AmbientLight,
  BufferGeometry,
  DirectionalLight,
  Float32BufferAttribute,
  Group,
  Line,
  LineBasicMaterial,
  OrbitControls,
  PerspectiveCamera,
  Quaternion,
  Scene,
  Vector3,
  WebGLRenderer,
} from "/vendor/three/three.min.js";
import { Body } from "/attitude/body.js";
import { COLOURS } from "/attitude/colours.js";
import { graticule } from "/attitude/shapes.js";
import { h } from "/dom.js";
import { viewByKeys } from "./keys.js";
import { t } from "./words.js";

const RADIUS = 1.25;
const Z_UP = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), -Math.PI / 2);
const AXES = [new Vector3(1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, 0, 1)];

export class View {
  #renderer = new WebGLRenderer({ antialias: true, alpha: true });
  #scene = new Scene();
  #camera = new PerspectiveCamera(38, 1, 0.1, 50);
  #world = new Group();
  #body = null;
  #size = "";
  #box;
  #run = null;
  #hours = null;
  #caption = h("span", { class: "caption" });
  #lines = AXES.map(
    (_, i) => new Line(new BufferGeometry(), new LineBasicMaterial({ color: COLOURS.axes[i] })),
  );
  #waits = false;

  /** Throws where the browser has no WebGL. */
  constructor(box) {
    this.#box = box;
    const sun = new DirectionalLight("#ffffff", 2.5);
    sun.position.set(2, 3, 4);
    this.#world.quaternion.copy(Z_UP);
    this.#world.add(graticule(RADIUS, 30, "#3b4a5e"), ...this.#lines);
    this.#scene.add(this.#world, sun, new AmbientLight("#ffffff", 0.9));
    this.#camera.position.set(2.6, 1.6, 3.2);
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    const controls = new OrbitControls(this.#camera, this.#renderer.domElement);
    Object.assign(controls, { enablePan: false, minDistance: 2.5, maxDistance: 9 });
    controls.addEventListener("change", () => this.#draw());
    box.append(this.#renderer.domElement, this.#caption);
    viewByKeys(this.#renderer.domElement, (around, over) => this.#turn(around, over, controls));
    new ResizeObserver(() => this.#fit()).observe(box);
    this.#fit();
  }

  show(run) {
    this.#run = run;
    this.#bodyOf(run.header.scene);
    const { values } = run.arrays.q;
    AXES.forEach((axis, j) => this.#trace(this.#lines[j], values, axis));
    this.at(this.#hours);
  }

  /** Shows the body at a time; null: at the end. */
  at(hours) {
    this.#hours = hours;
    if (!this.#run) return;
    const times = this.#run.arrays.t_s.values;
    const k = hours === null ? times.length - 1 : nearest(times, hours * 3600);
    const { arrays } = this.#run;
    const row = (name, size) => arrays[name].values.slice(size * k, size * (k + 1));
    this.#body.quaternion.set(...row("q", 4));
    const [rate, dipole] = [[...row("view.rate", 3)], [...row("view.dipole", 3)]];
    this.#body.show({ rate, dipole, field: null, sun: null }, true);
    const at = (times[k] / 3600).toFixed(2);
    this.#caption.textContent = t("{at} h; rate orange, dipole cyan; inertial axes", { at });
    this.#draw();
  }

  #turn(around, over, controls) {
    const place = this.#camera.position;
    const size = place.length();
    const polar = Math.min(Math.max(Math.acos(place.y / size) + over, 0.01), Math.PI - 0.01);
    const azimuth = Math.atan2(place.x, place.z) + around;
    const level = size * Math.sin(polar);
    place.set(level * Math.sin(azimuth), size * Math.cos(polar), level * Math.cos(azimuth));
    controls.update();
    this.#draw();
  }

  #bodyOf(scene) {
    const size = JSON.stringify(scene);
    if (size === this.#size) return;
    if (this.#body) {
      this.#world.remove(this.#body);
      this.#body.traverse((each) => {
        each.geometry?.dispose();
        for (const material of [each.material ?? []].flat()) material.dispose();
      });
    }
    this.#size = size;
    this.#body = new Body(scene);
    this.#world.add(this.#body);
  }

  #trace(line, q, axis) {
    const count = q.length / 4;
    const points = new Float32Array(3 * count);
    const turn = new Quaternion();
    const at = new Vector3();
    for (let i = 0; i < count; i++) {
      turn.set(q[4 * i], q[4 * i + 1], q[4 * i + 2], q[4 * i + 3]);
      at.copy(axis).applyQuaternion(turn).multiplyScalar(RADIUS).toArray(points, 3 * i);
    }
    line.geometry.dispose();
    line.geometry = new BufferGeometry().setAttribute(
      "position",
      new Float32BufferAttribute(points, 3),
    );
  }

  #fit() {
    const { clientWidth: width, clientHeight: height } = this.#box;
    if (!width || !height) return;
    this.#renderer.setSize(width, height);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    this.#draw();
  }

  #draw() {
    if (this.#waits) return;
    this.#waits = true;
    requestAnimationFrame(() => {
      this.#waits = false;
      this.#renderer.render(this.#scene, this.#camera);
    });
  }
}

function nearest(times, t) {
  let [low, high] = [0, times.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] < t) low = middle;
    else high = middle;
  }
  return t - times[low] < times[high] - t ? low : high;
}
