// The map: land, night, track, footprint, stations. Longitude is x, latitude upwards.

import { get, inBackground, route } from "../net/api.js";
import { svg } from "./svg.js";

/** Time between two questions for the map [ms]. */
const PAUSE_MS = 3000;

export class PassMap {
  element;
  #satellite;
  #land = svg("path", { class: "t-map__land" });
  #night = svg("path", { class: "t-map__night" });
  #track = svg("g", {});
  #footprint = svg("path", { class: "t-map__footprint" });
  #stations = svg("g", {});
  #here = svg("circle", { r: 2.6, class: "t-map__here" });
  #sun = svg("circle", { r: 3.2, class: "t-map__sun" });

  constructor(satellite) {
    this.#satellite = satellite;
    const grid = [...range(-150, 150, 30)].map((x) => `M${x} -90V90`);
    const rows = [...range(-60, 60, 30)].map((y) => `M-180 ${y}H180`);
    this.element = svg(
      "svg",
      { viewBox: "-180 -90 360 180", role: "img", class: "t-map", "aria-label": "Map" },
      this.#land,
      svg("path", { d: [...grid, ...rows].join(""), class: "t-map__grid" }),
      this.#night,
      this.#track,
      this.#footprint,
      this.#stations,
      this.#sun,
      this.#here,
    );
  }

  /** Follows a clock `now()` [ms], null while it is not known. */
  async start(now, signal) {
    const rings = await get("/api/coastline", {}, signal);
    this.#land.setAttribute("d", rings.map((ring) => `M${ring.map(point).join("L")}Z`).join(""));
    this.#follow(now, signal);
  }

  async #follow(now, signal) {
    while (!signal.aborted) {
      const time = now();
      if (time !== null) inBackground(this.#ask(time, signal), signal);
      await new Promise((resolve) => setTimeout(resolve, time === null ? 200 : PAUSE_MS));
    }
  }

  async #ask(time, signal) {
    const found = await get(route(this.#satellite.key, "map"), { time: Math.round(time) }, signal);
    const { at, track, footprint, sun, stations, time_ms } = found;
    const before = track.filter(([when]) => when <= time_ms).map(([, ...place]) => place);
    const after = track.filter(([when]) => when >= time_ms).map(([, ...place]) => place);
    this.#track.replaceChildren(
      svg("path", { d: open([...before, at]), class: "t-map__track is-past" }),
      svg("path", { d: open([at, ...after]), class: "t-map__track" }),
    );
    this.#footprint.setAttribute("d", open(footprint));
    this.#night.setAttribute("d", nightOf(sun));
    this.#stations.replaceChildren(...stations.flatMap(stationOf));
    move(this.#here, at);
    move(this.#sun, sun);
    this.#here.classList.toggle("is-dark", found.sunlit < 0.5);
    this.element.setAttribute("aria-label", words(found));
  }
}

function* range(first, last, step) {
  for (let value = first; value <= last; value += step) yield value;
}

const point = ([longitude, latitude]) => `${longitude} ${-latitude}`;
const fold = (longitude) => ((((longitude + 180) % 360) + 360) % 360) - 180;

function move(element, [latitude, longitude]) {
  element.setAttribute("cx", fold(longitude));
  element.setAttribute("cy", -latitude);
}

/** A line through places (latitude, longitude), interrupted where it leaves the map. */
function open(places) {
  let last = null;
  return places
    .map(([latitude, longitude]) => {
      const x = fold(longitude);
      const isFirst = last === null || Math.abs(x - last) > 180;
      last = x;
      return `${isFirst ? "M" : "L"}${x} ${-latitude}`;
    })
    .join("");
}

/** Where the Sun is below the horizon, from the place where it is in the zenith. */
function nightOf([latitude, longitude]) {
  const radians = Math.PI / 180;
  // At the equinox the edge is a meridian: the tangent must not be zero.
  const slope = Math.tan(Math.sign(latitude || 1) * Math.max(Math.abs(latitude), 0.01) * radians);
  const edge = [...range(-180, 180, 2)].map((x) => {
    const y = Math.atan(-Math.cos((x - longitude) * radians) / slope) / radians;
    return `${x} ${-y}`;
  });
  const pole = latitude > 0 ? 90 : -90;
  return `M-180 ${pole}L${edge.join("L")}L180 ${pole}Z`;
}

function stationOf({ name, at: [latitude, longitude], circle }) {
  const [x, y] = [fold(longitude), -latitude];
  const mark = svg("path", { d: `M${x} ${y - 3}l2.6 4.6h-5.2Z`, class: "t-map__station" });
  const label = svg("text", { x: x + 4, y: y - 2, class: "t-map__name" }, name);
  return [svg("path", { d: open(circle), class: "t-map__circle" }), mark, label];
}

function words({ at: [latitude, longitude], height_km, sunlit }) {
  const north = `${Math.abs(latitude).toFixed(1)}° ${latitude < 0 ? "south" : "north"}`;
  const east = `${Math.abs(fold(longitude)).toFixed(1)}° ${fold(longitude) < 0 ? "west" : "east"}`;
  const light = sunlit < 0.5 ? "in the Earth's shadow" : "in sunlight";
  return `Map: the satellite is over ${north}, ${east}, ${height_km.toFixed(0)} km high, ${light}`;
}
