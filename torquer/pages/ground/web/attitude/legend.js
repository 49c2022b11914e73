// What the arrows are, with their magnitudes, apart by telemetry and model.

import { h, number } from "../dom.js";
import { QUALITIES } from "../net/rows.js";
import { inZone } from "../times.js";
import { COLOURS } from "./colours.js";

const TELEMETRY = {
  rate: ["Rate", "omega"],
  field: ["Magnetic field, magnetometer", "b"],
  sun: ["Direction to the Sun, Sun sensors", "sun"],
  dipole: ["Commanded dipole", "dipole"],
};
const MODEL = {
  sun: "Direction to the Sun",
  field: "Magnetic field",
  place: "Position",
};

export class Legend {
  #time = h("p", { class: "t-note" });
  #telemetry = {};
  #model = {};
  #units;

  constructor(packet, hasOrbit) {
    const unit = (base) => packet.vectors.get(base)?.[0].unit ?? "";
    this.#units = Object.fromEntries(
      Object.entries(TELEMETRY).map(([what, [, base]]) => [what, unit(base)]),
    );
    const lines = Object.entries(TELEMETRY).map(([what, [text]]) =>
      line(this.#telemetry, what, text, COLOURS[what], ""),
    );
    const ofModel = Object.entries(MODEL).map(([what, text]) =>
      line(this.#model, what, text, COLOURS[what] ?? COLOURS.track, "is-model"),
    );
    this.element = h(
      "div",
      {},
      h("h3", { class: "t-heading" }, "Telemetry"),
      this.#time,
      h("ul", {}, axes(), lines),
      hasOrbit ? h("h3", { class: "t-heading" }, "Model on the ground") : null,
      hasOrbit ? h("ul", {}, ofModel) : null,
      h("p", { class: "t-note" }, "Arrows show directions; magnitudes are written here."),
    );
  }

  show(row, found, isOld) {
    this.element.classList.toggle("is-old", isOld);
    this.#time.textContent = row ? `${inZone(row.time)} on board, ${QUALITIES[row.quality]}` : "";
    for (const what of Object.keys(TELEMETRY))
      this.#telemetry[what].textContent = inWords(what, found[what], this.#units[what]);
  }

  orbit({ position_km, field_t, sunlit }) {
    this.#model.sun.textContent = sunlit > 0.5 ? "sunlit" : "in the Earth's shadow";
    this.#model.field.textContent = field_t ? `${Math.round(1e9 * Math.hypot(...field_t))} nT` : "";
    const distance = Math.hypot(...position_km).toFixed(0);
    this.#model.place.textContent = `${distance} km from the Earth's centre`;
  }
}

function inWords(what, vector, unit) {
  if (!vector) return "unknown";
  const size = Math.hypot(...vector);
  if (what === "sun") return size > 0 ? "seen" : "not seen";
  return `${number(Number(size.toPrecision(4)))} ${unit.replace("A m2", "A m²")}`;
}

function line(values, what, text, colour, kind) {
  values[what] = h("span", { class: "t-attitude__value" });
  const swatch = h("i", { class: `t-attitude__swatch ${kind}` });
  swatch.style.color = colour;
  return h("li", {}, swatch, h("span", {}, text), values[what]);
}

function axes() {
  const names = ["x", "y", "z"].map((name, i) => {
    const letter = h("b", {}, `${name} `);
    letter.style.color = COLOURS.axes[i];
    return letter;
  });
  return h(
    "li",
    {},
    h("i", { class: "t-attitude__swatch is-none" }),
    h("span", {}, "Body axes"),
    names,
  );
}
