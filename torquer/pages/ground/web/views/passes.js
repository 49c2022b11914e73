// Passes: the last and next ones, the map, and the sky of the pass that is chosen.

import { every, h, utc } from "../dom.js";
import { route } from "../net/api.js";
import { passesOf, skyAt, spanInWords } from "../net/passes.js";
import { PassMap } from "./pass_map.js";
import { PassSky } from "./pass_sky.js";

/** Elements that are older are called so [days]. */
const OLD_DAYS = 3;

export function showPasses(element, context) {
  const view = new PassesView(context);
  element.append(view.element);
  return view.start();
}

class PassesView {
  #context;
  #passes;
  #map;
  #sky = new PassSky();
  #clock = h("p", { class: "t-note", "data-role": "clock" });
  #orbit = h("p", { class: "t-note", "data-role": "orbit" });
  #failure = h("p", { class: "t-failure", role: "alert" });
  #values = h("dl", { class: "t-pass__values" });
  #title = h("h2", { class: "t-heading" });
  #body = h("tbody");
  #lines = [];
  #chosen = null;

  constructor(context) {
    this.#context = context;
    this.#passes = passesOf(context.satellite, context.openmct);
    this.#map = new PassMap(context.satellite);
    const list = h("div", { class: "t-passes__list" }, this.#table());
    const sky = h("section", { class: "t-passes__sky" }, this.#title, this.#sky.element, this.#values);
    this.element = h(
      "div",
      { class: "t-passes t-scroll" },
      h("div", { class: "t-passes__head" }, this.#failure, this.#clock, this.#orbit),
      h("div", { class: "t-passes__map" }, this.#map.element),
      sky,
      list,
    );
  }

  async start() {
    const { signal } = this.#context;
    this.#passes.follow(() => this.#drawList(), signal);
    every(1000, () => this.#tick(), signal);
    this.#tick();
    await this.#map.start(() => this.#passes.now(), signal);
  }

  #table() {
    const titles = ["Station", "AOS [UTC]", "LOS [UTC]", "", "Highest", "Azimuths", "Light"];
    const more = ["Doppler [kHz]", "Down [kB]", "Report"];
    const cells = [...titles, ...more].map((title) => h("th", { scope: "col" }, title));
    const caption = h("caption", { class: "t-note" }, "Passes: choose a station's name for its sky");
    return h("table", { class: "t-table" }, caption, h("thead", {}, h("tr", {}, cells)), this.#body);
  }

  #drawList() {
    const { found, failure } = this.#passes;
    this.#failure.textContent = failure;
    this.#orbit.textContent = found ? `Orbit: ${found.orbit}` : "";
    const age = Math.abs(found?.elements?.age_days ?? 0);
    this.#orbit.classList.toggle("is-old", age > OLD_DAYS);
    this.#lines = (found?.passes ?? []).map((pass) => this.#line(pass));
    this.#body.replaceChildren(...this.#lines.map(({ row }) => row));
    this.#tick();
  }

  #line(pass) {
    const name = h(
      "button",
      { class: "t-pass__name", onclick: () => this.#choose(pass) },
      pass.station,
    );
    const when = h("td", { class: "t-pass__when" });
    const { aos, los, highest } = pass;
    const report = h("td");
    const row = h(
      "tr",
      { "data-station": pass.station, "data-aos": aos.time_ms },
      h("td", {}, name),
      h("td", {}, (pass.rises ? "" : "before ") + utc(aos.time_ms)),
      h("td", {}, (pass.sets ? "" : "after ") + utc(los.time_ms).slice(11)),
      when,
      h("td", {}, `${highest.elevation_deg.toFixed(1)}°`),
      h("td", {}, `${aos.azimuth_deg.toFixed(0)}° to ${los.azimuth_deg.toFixed(0)}°`),
      h("td", {}, lightOf(pass)),
      h("td", {}, dopplerOf(pass)),
      h("td", {}, downlinkOf(pass)),
      report,
    );
    return { pass, row, name, when, report };
  }

  #choose(pass) {
    this.#chosen = pass.aos.time_ms + pass.station;
    this.#tick();
  }

  #tick() {
    const now = this.#passes.now();
    if (now === null) return;
    const own = this.#passes.found.clock === "satellite";
    const whose = own ? "the satellite's clock, which is of another epoch" : "this machine's clock";
    this.#clock.textContent = `${utc(now)} UTC, by ${whose}`;
    const next = this.#passes.next();
    const chosen = this.#lines.find(({ pass }) => pass.aos.time_ms + pass.station === this.#chosen);
    const shown = chosen?.pass ?? next;
    for (const line of this.#lines) this.#showTimes(line, now, shown);
    this.#showPass(shown, now);
  }

  #showTimes({ pass, row, name, when, report }, now, shown) {
    const [before, after] = [pass.aos.time_ms - now, now - pass.los.time_ms];
    const state = before > 0 ? "next" : after > 0 ? "past" : "now";
    const ending = `LOS in ${spanInWords(-after)}`;
    when.textContent =
      { next: `in ${spanInWords(before)}`, past: `${spanInWords(after)} ago` }[state] ?? ending;
    row.dataset.state = state;
    name.setAttribute("aria-pressed", String(pass === shown));
    if (state !== "next" && !report.firstChild) report.append(this.#link(pass));
  }

  #link(pass) {
    const [start, end] = [pass.aos.time_ms, pass.los.time_ms];
    const query = new URLSearchParams({ start, end, station: pass.station });
    const href = `${route(this.#context.satellite.key, "report")}?${query}`;
    const label = `Report of the pass over ${pass.station} at ${utc(start)}`;
    return h("a", { href, target: "_blank", "aria-label": label }, "report");
  }

  #showPass(pass, now) {
    this.#sky.show(pass, pass && skyAt(pass, now));
    this.#title.textContent = pass ? `${pass.station}, ${utc(pass.aos.time_ms)} UTC` : "No pass";
    const pairs = pass ? valuesOf(pass, skyAt(pass, now)) : [];
    this.#values.replaceChildren(
      ...pairs.map(([name, text]) => h("div", {}, h("dt", {}, name), h("dd", {}, text))),
    );
  }
}

const kHz = (hz) => `${hz > 0 ? "+" : ""}${(hz / 1000).toFixed(2)}`;

function lightOf({ eclipse_ms, duration_s, light }) {
  const dark = eclipse_ms.reduce((sum, [a, b]) => sum + (b - a) / 1000, 0);
  const part = dark > duration_s - 1 ? "in eclipse" : `eclipse ${dark.toFixed(0)} s`;
  return `${dark ? part : "sunlit"}, ${light} below`;
}

function dopplerOf({ aos, los }) {
  return aos.doppler_hz === null ? "" : `${kHz(aos.doppler_hz)} to ${kHz(los.doppler_hz)}`;
}

function downlinkOf({ downlink }) {
  if (!downlink) return "";
  const left = downlink.left_packets ? `, ${downlink.left_packets} packets stay` : "";
  return `${Math.round(downlink.bytes / 1000)}${left}`;
}

/** Names and texts of the pass that is shown: as it is now, while it goes on. */
function valuesOf({ highest, closest, eclipse_ms, downlink }, now) {
  const pairs = now
    ? [
        ["Elevation now", `${now.elevation.toFixed(1)}°`],
        ["Azimuth now", `${now.azimuth.toFixed(1)}°`],
        ["Range now", `${now.range.toFixed(0)} km`],
        ...(now.doppler === null ? [] : [["Doppler now", `${kHz(now.doppler)} kHz`]]),
      ]
    : [];
  const shadow = eclipse_ms.map(([a, b]) => `${utc(a).slice(11)} to ${utc(b).slice(11)}`);
  return [
    ...pairs,
    ["Highest", `${highest.elevation_deg.toFixed(1)}° at ${utc(highest.time_ms).slice(11)}`],
    ["Closest (TCA)", `${closest.range_km.toFixed(0)} km at ${utc(closest.time_ms).slice(11)}`],
    ["Earth's shadow", shadow.join(", ") || "no"],
    ...(downlink?.stored ?? []).map((kind) => [
      `Stored: ${kind.packet}`,
      `${kind.fit} of ${kind.packets} packets fit`,
    ]),
  ];
}
