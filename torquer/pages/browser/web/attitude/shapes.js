// Shapes of which the scenes are made.

import {
  BufferGeometry,
  ConeGeometry,
  CylinderGeometry,
  DoubleSide,
  Float32BufferAttribute,
  Group,
  Line,
  LineBasicMaterial,
  LineDashedMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  Vector3,
} from "/vendor/three/three.min.js";

const UP = new Vector3(0, 1, 0);

/** A direction. `isModel`: dashed, for what telemetry did not say. */
export class Arrow extends Group {
  constructor(colour, length, { isModel = false, width = 0.012 } = {}) {
    super();
    const head = 9 * width;
    const material = new MeshBasicMaterial({ color: colour });
    const tip = new Mesh(new ConeGeometry(head / 2.4, head, 20), material);
    tip.position.y = length - head / 2;
    this.add(isModel ? dashed(colour, length - head) : shaft(material, width, length - head), tip);
    this.end = new Group();
    this.end.position.y = length + 0.06;
    this.add(this.end);
    this.visible = false;
  }

  /** Points along `[x, y, z]`; hides itself for null and for zeros. */
  point(direction) {
    const found = direction && new Vector3(...direction);
    this.visible = Boolean(found) && found.lengthSq() > 0;
    if (this.visible) this.quaternion.setFromUnitVectors(UP, found.normalize());
  }
}

function shaft(material, width, length) {
  const mesh = new Mesh(new CylinderGeometry(width, width, length, 12), material);
  mesh.position.y = length / 2;
  return mesh;
}

function dashed(colour, length) {
  const material = new LineDashedMaterial({ color: colour, dashSize: 0.07, gapSize: 0.05 });
  const line = new Line(
    pathOf([
      [0, 0, 0],
      [0, length, 0],
    ]),
    material,
  );
  line.computeLineDistances();
  return line;
}

/** Geometry of a line through points. */
export function pathOf(points) {
  const geometry = new BufferGeometry();
  return geometry.setAttribute("position", new Float32BufferAttribute(points.flat(), 3));
}

/** A translucent cone with its tip at the origin, around `axis`. */
export function fieldOfView(axis, halfAngleDeg, length, colour) {
  // A cone near 90 degrees would be a disc without end.
  const half = (Math.min(halfAngleDeg, 80) * Math.PI) / 180;
  const geometry = new ConeGeometry(length * Math.sin(half), length * Math.cos(half), 40, 1, true);
  geometry.rotateX(Math.PI);
  geometry.translate(0, (length * Math.cos(half)) / 2, 0);
  const look = { color: colour, transparent: true, opacity: 0.1, side: DoubleSide };
  const cone = new Mesh(geometry, new MeshBasicMaterial({ ...look, depthWrite: false }));
  cone.quaternion.setFromUnitVectors(UP, new Vector3(...axis).normalize());
  return cone;
}

/** Circles of latitude and longitude every `stepDeg` on a sphere around z. */
export function graticule(radius, stepDeg, colour) {
  const points = [];
  const at = (lat, lon) => [
    radius * Math.cos(lat) * Math.cos(lon),
    radius * Math.cos(lat) * Math.sin(lon),
    radius * Math.sin(lat),
  ];
  const rad = Math.PI / 180;
  const fine = 3;
  for (let a = -90 + stepDeg; a < 90; a += stepDeg)
    for (let b = 0; b < 360; b += fine)
      points.push(at(a * rad, b * rad), at(a * rad, (b + fine) * rad));
  for (let a = 0; a < 360; a += stepDeg)
    for (let b = -90; b < 90; b += fine)
      points.push(at(b * rad, a * rad), at((b + fine) * rad, a * rad));
  const look = { color: colour, transparent: true, opacity: 0.35 };
  return new LineSegments(pathOf(points), new LineBasicMaterial(look));
}
