// Earth, Sun, field and orbit by the model on the ground, in inertial axes, at two scales.

import {
  BufferGeometry,
  CylinderGeometry,
  Group,
  Line,
  LineBasicMaterial,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  SphereGeometry,
  Vector3,
} from "/vendor/three/three.min.js";
import { COLOURS } from "./colours.js";
import { Arrow, graticule, pathOf } from "./shapes.js";

const EARTH_KM = 6378.137;
/** Distance of the Earth's centre from the satellite in the near scene, whose body has length 1. */
const EARTH_DISTANCE = 60;

function globe(radius, stepDeg) {
  const material = new MeshLambertMaterial({ color: COLOURS.earth });
  const sphere = new Mesh(new SphereGeometry(radius, 96, 64), material);
  const group = new Group();
  group.add(sphere, graticule(radius * 1.002, stepDeg, COLOURS.grid));
  return group;
}

/** Around the satellite: the Earth in its direction and at its apparent size, Sun and field. */
export class Near extends Group {
  #earth = globe(1, 5);
  #sun = new Arrow(COLOURS.sun, 1.9, { isModel: true });
  #field = new Arrow(COLOURS.field, 1.75, { isModel: true });
  labels = [
    { at: this.#sun.end, text: "Sun (model)", colour: COLOURS.sun },
    { at: this.#field.end, text: "field (model)", colour: COLOURS.field },
  ];

  constructor() {
    super();
    this.#earth.visible = false;
    this.add(this.#earth, this.#sun, this.#field);
  }

  show({ position_km, sun, field_t }) {
    const position = new Vector3(...position_km);
    this.#earth.visible = true;
    this.#earth.scale.setScalar((EARTH_DISTANCE * EARTH_KM) / position.length());
    this.#earth.position.copy(position.normalize().multiplyScalar(-EARTH_DISTANCE));
    this.#sun.point(sun);
    this.#field.point(field_t);
  }
}

/** The whole orbit; the Earth has radius 1. */
export class Far extends Group {
  #track = new Line(new BufferGeometry(), new LineBasicMaterial({ color: COLOURS.track }));
  #satellite = new Mesh(new SphereGeometry(0.055, 20, 12), new MeshBasicMaterial());
  #sun = new Arrow(COLOURS.sun, 1.5, { isModel: true, width: 0.02 });
  #umbra = umbra();
  /** Radius of a sphere around all that is drawn. */
  reach = 1.5;

  constructor() {
    super();
    this.visible = false;
    this.add(globe(1, 30), this.#track, this.#satellite, this.#sun, this.#umbra);
  }

  show({ position_km, track_km, sun, sunlit }) {
    this.visible = true;
    const scaled = (point) => point.map((x) => x / EARTH_KM);
    this.#track.geometry.dispose();
    this.#track.geometry = pathOf(track_km.map(scaled));
    this.#satellite.position.set(...scaled(position_km));
    this.#satellite.material.color.set(sunlit > 0.5 ? COLOURS.sun : COLOURS.dipole);
    this.#sun.point(sun);
    this.#umbra.quaternion.setFromUnitVectors(
      new Vector3(0, -1, 0),
      new Vector3(...sun).normalize(),
    );
    this.reach = Math.max(1.5, ...track_km.map((point) => Math.hypot(...point) / EARTH_KM));
  }
}

function umbra() {
  const geometry = new CylinderGeometry(1.004, 1.004, 2, 96, 1, true);
  geometry.translate(0, 1, 0);
  const look = { color: COLOURS.umbra, transparent: true, opacity: 0.1, depthWrite: false };
  return new Mesh(geometry, new MeshBasicMaterial(look));
}
