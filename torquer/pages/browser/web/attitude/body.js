// The satellite: a box with its axes, its sensors' fields of view, and vectors in body axes.

import {
  BoxGeometry,
  Color,
  EdgesGeometry,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshLambertMaterial,
} from "/vendor/three/three.min.js";
import { COLOURS } from "./colours.js";
import { Arrow, fieldOfView } from "./shapes.js";

const UNKNOWN_SIZE_M = [1, 1, 1];
/** Length of what is drawn around the body, whose longest side is 1. */
const LENGTHS = { axes: 0.95, field: 1.45, sun: 1.6, rate: 1.3, dipole: 1.15, cone: 0.85 };
const VECTORS = ["field", "sun", "rate", "dipole"];
/** Faces lie a little behind their edges. */
const SOLID = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
/** Light that is left in the Earth's shadow. */
const IN_SHADOW = 0.45;

export class Body extends Group {
  #faces;
  #vectors = {};
  #cones = new Group();
  #isLit = true;
  /** Points with a text, for labels. */
  labels = [];

  constructor(scene) {
    super();
    const size = scene?.size_m ?? UNKNOWN_SIZE_M;
    const sides = size.map((side) => side / Math.max(...size));
    this.#faces = this.#box(sides);
    ["x", "y", "z"].forEach((name, i) => this.#axis(name, i));
    for (const what of VECTORS) this.#vector(what);
    for (const sensor of scene?.sensors ?? []) this.#cones.add(coneOf(sensor, sides));
    this.add(this.#cones);
  }

  /** Vectors in body axes, by name; nothing but a grey box where the attitude is unknown or old. */
  show(vectors, isValid) {
    for (const what of VECTORS) this.#vectors[what].point(isValid ? vectors[what] : null);
    this.#paint(isValid);
  }

  light(isLit) {
    this.#isLit = isLit;
  }

  showCones(isShown) {
    this.#cones.visible = isShown;
  }

  #box(sides) {
    const geometry = new BoxGeometry(...sides);
    const faces = Array.from({ length: 6 }, () => new MeshLambertMaterial(SOLID));
    const edges = new LineSegments(
      new EdgesGeometry(geometry),
      new LineBasicMaterial({ color: "#dfe6f5" }),
    );
    this.add(new Mesh(geometry, faces), edges);
    return faces;
  }

  #axis(name, i) {
    const arrow = new Arrow(COLOURS.axes[i], LENGTHS.axes, { width: 0.009 });
    arrow.point([0, 1, 2].map((k) => (k === i ? 1 : 0)));
    this.add(arrow);
    this.labels.push({ at: arrow.end, text: name, colour: COLOURS.axes[i] });
  }

  #vector(what) {
    const arrow = new Arrow(COLOURS[what], LENGTHS[what]);
    this.#vectors[what] = arrow;
    this.add(arrow);
    this.labels.push({ at: arrow.end, text: what, colour: COLOURS[what] });
  }

  #paint(isValid) {
    const light = this.#isLit ? 1 : IN_SHADOW;
    this.#faces.forEach((face, i) => {
      // Sides look like solar panels, the faces across z like the structure.
      const colour = i < 4 ? COLOURS.panel : COLOURS.lit;
      face.color = isValid ? new Color(colour).multiplyScalar(light) : new Color(COLOURS.grey);
      face.transparent = !isValid;
      face.opacity = isValid ? 1 : 0.6;
      face.needsUpdate = true;
    });
  }
}

function coneOf({ kind, axis, half_angle_deg }, sides) {
  const colour = kind === "sun" ? COLOURS.sun : COLOURS.horizon;
  const cone = fieldOfView(axis, half_angle_deg, LENGTHS.cone, colour);
  // The tip stands on the face that the axis leaves through.
  const reach = Math.min(
    ...axis.map((part, i) => (part ? sides[i] / 2 / Math.abs(part) : Infinity)),
  );
  cone.position.set(...axis.map((part) => part * reach));
  return cone;
}
