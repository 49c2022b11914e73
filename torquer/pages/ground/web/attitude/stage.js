// Both scenes on one canvas: the satellite, and inset its orbit; drawn when something changes.

import {
  AmbientLight,
  DirectionalLight,
  Group,
  Matrix4,
  OrbitControls,
  PerspectiveCamera,
  Quaternion,
  Scene,
  Vector3,
  WebGLRenderer,
} from "/vendor/three/three.min.js";
import { h, oncePerFrame } from "../dom.js";
import { Body } from "./body.js";
import { Labels } from "./labels.js";
import { Far, Near } from "./surroundings.js";

const BACKGROUND = "#14171c";
const INSET_BACKGROUND = "#0c0e12";
/** Share of the shorter side that the inset takes. */
const INSET = 0.34;
/** Turns z up where three.js has y up. */
const Z_UP = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), -Math.PI / 2);

export class Stage {
  #box;
  #renderer;
  #near = new Near();
  #far = new Far();
  #body;
  #nearWorld = new World(this.#near);
  #farWorld = new World(this.#far);
  #camera = new PerspectiveCamera(40, 1, 0.05, 400);
  #farCamera = new PerspectiveCamera(30, 1, 0.1, 100);
  #labels;
  #inset = h("div", { class: "t-attitude__inset", hidden: true }, "orbit: model on the ground");
  #frame = "inertial";
  #orbit = null;
  #attitude = null;

  /** Throws where the browser has no WebGL. */
  constructor(box, scene, signal) {
    this.#box = box;
    this.#renderer = new WebGLRenderer({ antialias: true });
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.#renderer.setScissorTest(true);
    this.#body = new Body(scene);
    this.#nearWorld.axes.add(this.#body);
    box.append(this.#renderer.domElement, this.#inset);
    this.#labels = new Labels(box, [...this.#body.labels, ...this.#near.labels]);
    this.draw = oncePerFrame(() => this.#draw(), signal);
    this.#control(signal);
    this.#watchSize(signal);
    signal.addEventListener("abort", () => this.#close());
  }

  /** Telemetry: `attitude`, and vectors in body axes. */
  show(found, isOld) {
    const { attitude } = found;
    this.#attitude = attitude && new Quaternion(...attitude).normalize();
    this.#body.show(found, attitude !== null && !isOld);
    this.#turn();
    this.draw();
  }

  orbit(found) {
    this.#orbit = found;
    this.#inset.hidden = false;
    this.#near.show(found);
    this.#far.show(found);
    this.#body.light(found.sunlit > 0.5);
    this.#nearWorld.light(found.sun);
    this.#farWorld.light(found.sun);
    this.#turn();
    this.draw();
  }

  /** Axes to which the view is fixed: "orbital", "inertial" or "body". */
  follow(frame) {
    this.#frame = frame;
    this.#turn();
    this.draw();
  }

  showCones(isShown) {
    this.#body.showCones(isShown);
    this.draw();
  }

  #control(signal) {
    this.#camera.position.set(2.9, 1.7, 3.9);
    const controls = new OrbitControls(this.#camera, this.#renderer.domElement);
    Object.assign(controls, { enablePan: false, minDistance: 1.5, maxDistance: 12 });
    controls.addEventListener("change", this.draw);
    signal.addEventListener("abort", () => controls.dispose());
  }

  #watchSize(signal) {
    const observer = new ResizeObserver(() => {
      const { clientWidth, clientHeight } = this.#box;
      this.#renderer.setSize(clientWidth, clientHeight);
      this.draw();
    });
    observer.observe(this.#box);
    signal.addEventListener("abort", () => observer.disconnect());
  }

  #close() {
    this.#renderer.dispose();
    this.#renderer.forceContextLoss();
  }

  /**
   * Turns the worlds, in inertial axes, so that the chosen axes stand still. A body whose attitude
   * is unknown stands along the axes of the view: along nobody's.
   */
  #turn() {
    const turned = rotationOf(this.#frame, this.#orbit, this.#attitude);
    for (const world of [this.#nearWorld, this.#farWorld]) world.axes.quaternion.copy(turned);
    this.#body.quaternion.copy(this.#attitude ?? turned.clone().invert());
  }

  #draw() {
    const { clientWidth: width, clientHeight: height } = this.#box;
    if (!width || !height) return;
    this.#render(this.#nearWorld, this.#camera, BACKGROUND, [0, 0, width, height]);
    this.#labels.place(this.#camera, width, height);
    if (!this.#far.visible) return;
    const side = Math.round(INSET * Math.min(width, height));
    this.#farCamera.position.copy(this.#camera.position).setLength(4.2 * this.#far.reach);
    this.#farCamera.lookAt(0, 0, 0);
    this.#inset.style.width = this.#inset.style.height = `${side}px`;
    this.#render(this.#farWorld, this.#farCamera, INSET_BACKGROUND, [width - side, 0, side, side]);
  }

  #render(world, camera, background, [left, bottom, width, height]) {
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    this.#renderer.setViewport(left, bottom, width, height);
    this.#renderer.setScissor(left, bottom, width, height);
    this.#renderer.setClearColor(background);
    this.#renderer.render(world.scene, camera);
  }
}

/** A scene with a group in inertial axes, lit from the Sun. */
class World {
  scene = new Scene();
  axes = new Group();
  #sun = new DirectionalLight("#ffffff", 3);

  constructor(content) {
    this.axes.add(content, this.#sun, this.#sun.target);
    this.#sun.position.set(1, 1, 1);
    this.scene.add(this.axes, new AmbientLight("#ffffff", 0.7));
  }

  light(sun) {
    this.#sun.position.set(...sun);
  }
}

/** Rotation of inertial axes to those of three.js. */
function rotationOf(frame, orbit, attitude) {
  if (frame === "body" && attitude) return Z_UP.clone().multiply(attitude.clone().invert());
  if (frame === "orbital" && orbit) return orbital(orbit);
  return Z_UP.clone();
}

/** Up is away from the Earth, to the right is along the track. */
function orbital({ position_km, track_km }) {
  const position = new Vector3(...position_km);
  const [before, after] = [track_km[0], track_km[Math.floor(track_km.length / 4)]];
  const normal = new Vector3(...before).cross(new Vector3(...after)).normalize();
  const up = position.normalize();
  const along = normal.clone().cross(up).normalize();
  const axes = new Matrix4().makeBasis(along, up, along.clone().cross(up));
  return new Quaternion().setFromRotationMatrix(axes).invert();
}
