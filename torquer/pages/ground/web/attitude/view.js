// The view "Attitude 3D": the satellite by telemetry, its surroundings by a model on the ground.

import { every, h } from "../dom.js";
import { get, route } from "../net/api.js";
import { vector } from "../satellites.js";
import { Legend } from "./legend.js";
import { OrbitSource } from "./orbit_source.js";
import { Stage } from "./stage.js";

const PACKET = "extended";
/** Fields of the packet by what they are drawn as. */
const FIELDS = {
  attitude: "q_inertial",
  field: "b",
  sun: "sun",
  rate: "omega",
  dipole: "dipole",
};
/** Age from which the newest row is no longer taken for the present [s]. */
const OLD_S = 10;
const FRAMES = { orbital: "orbital axes", inertial: "inertial axes", body: "body axes" };

export async function showAttitude(element, context) {
  const { satellite, signal } = context;
  const packet = satellite.packets.get(PACKET);
  if (!packet) throw new Error(`This satellite has no packet "${PACKET}".`);
  const scene = satellite.has.scene ? await get(route(satellite.key, "scene"), {}, signal) : null;
  const view = new AttitudeView(packet, scene, context);
  element.append(view.element);
  await view.start();
}

class AttitudeView {
  #packet;
  #context;
  #row = null;
  #orbit = null;
  #stage;
  #legend;
  #banner = h("p", { class: "t-attitude__banner", role: "status" });

  constructor(packet, scene, context) {
    this.#packet = packet;
    this.#context = context;
    const { satellite, signal } = context;
    const box = h("div", { class: "t-attitude__stage" });
    this.#stage = stageIn(box, scene, signal);
    this.#legend = new Legend(packet, satellite.has.orbit);
    this.element = h(
      "div",
      { class: "t-attitude" },
      box,
      this.#banner,
      h("div", { class: "t-attitude__legend", tabindex: 0 }, this.#choices(satellite), this.#legend.element),
    );
  }

  start() {
    const { rows, satellite, signal } = this.#context;
    every(1000, () => this.#draw(), signal);
    const takeOrbit = (found) => {
      this.#legend.orbit(found);
      this.#stage?.orbit(found);
    };
    if (satellite.has.orbit) this.#orbit = new OrbitSource(satellite.key, signal, takeOrbit);
    const take = (row) => this.#take(row);
    return rows.follow(satellite.key, PACKET, take, signal);
  }

  #choices({ has }) {
    const options = Object.entries(FRAMES).filter(([frame]) => frame !== "orbital" || has.orbit);
    const frame = h(
      "select",
      { "aria-label": "Axes of the view", onchange: () => this.#stage?.follow(frame.value) },
      options.map(([value, text]) => h("option", { value }, `view fixed to ${text}`)),
    );
    this.#stage?.follow(frame.value);
    const cones = h("input", {
      type: "checkbox",
      checked: true,
      onchange: () => this.#stage?.showCones(cones.checked),
    });
    const label = h("label", {}, cones, " fields of view of sensors");
    return h("div", { class: "t-attitude__choices" }, frame, has.scene ? label : null);
  }

  #take(row) {
    this.#row = row;
    this.#orbit?.at(row.time);
    this.#draw();
  }

  #draw() {
    const found = this.#found();
    const age = this.#row ? (performance.now() - this.#row.arrived) / 1000 : Infinity;
    const isOld = age > OLD_S;
    this.#banner.textContent = bannerText(this.#row, found, age, isOld);
    this.#legend.show(this.#row, found, isOld);
    this.#stage?.show(found, isOld);
  }

  /** Vectors of the newest row by what they are; null where unknown. */
  #found() {
    const of = (base) => this.#row && vector(this.#packet, this.#row, base);
    return Object.fromEntries(Object.entries(FIELDS).map(([what, base]) => [what, of(base)]));
  }
}

function bannerText(row, { attitude }, age, isOld) {
  const unknown = attitude ? "" : "attitude unknown";
  if (!row) return "no telemetry yet";
  if (!isOld) return unknown;
  const none = Number.isFinite(age) ? `no telemetry for ${Math.floor(age)} s` : "no live telemetry";
  return `${none}; ${unknown || "last attitude shown"}`;
}

/** Without WebGL the numbers are shown all the same. */
function stageIn(box, scene, signal) {
  try {
    return new Stage(box, scene, signal);
  } catch (error) {
    console.warn(error);
    box.append(
      h("p", { class: "t-failure" }, "This browser cannot draw in 3D: it offers no WebGL."),
    );
    return null;
  }
}
