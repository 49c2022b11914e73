// The sky over a station: a pass as a line, zenith in the middle, north up, east right.

import { svg } from "./svg.js";

const RIM = 90;

export class PassSky {
  element;
  #lines = svg("g", {});
  #now = svg("circle", { r: 4.5, class: "t-sky__now" });

  constructor() {
    const rings = [0, 30, 60].map((height) => svg("circle", { r: RIM - height, class: "t-sky__ring" }));
    const names = ["N", "E", "S", "W"].map((name, k) => {
      const [x, y] = place(90 * k, -9);
      return svg("text", { x, y: y + 3.5, class: "t-sky__name" }, name);
    });
    const heights = [30, 60].map((height) =>
      svg("text", { x: 2, y: height - RIM - 1.5, class: "t-sky__height" }, `${height}°`),
    );
    this.element = svg(
      "svg",
      { viewBox: "-108 -108 216 216", role: "img", class: "t-sky" },
      ...rings,
      svg("path", { d: `M0 ${-RIM}V${RIM}M${-RIM} 0H${RIM}`, class: "t-sky__ring" }),
      ...names,
      ...heights,
      this.#lines,
      this.#now,
    );
  }

  /** A pass, and where the satellite is, if the pass goes on. */
  show(pass, now) {
    this.#lines.replaceChildren(...(pass ? parts(pass.curve).map(line) : []), ...ends(pass));
    this.#now.toggleAttribute("hidden", !now);
    this.#now.style.display = now ? "" : "none";
    if (now) {
      const [x, y] = place(now.azimuth, now.elevation);
      this.#now.setAttribute("cx", x);
      this.#now.setAttribute("cy", y);
    }
    this.element.setAttribute("aria-label", words(pass));
  }
}

const place = (azimuth, elevation) => {
  const [angle, far] = [(azimuth * Math.PI) / 180, RIM - elevation];
  return [far * Math.sin(angle), -far * Math.cos(angle)];
};

/** A curve cut where the light changes; neighbouring parts share a point. */
function parts(curve) {
  const found = [];
  curve.forEach((point, k) => {
    const last = found.at(-1);
    if (last?.sunlit === point[5]) last.points.push(point);
    else found.push({ sunlit: point[5], points: k ? [curve[k - 1], point] : [point] });
  });
  return found;
}

function line({ sunlit, points }) {
  const text = points.map(([, azimuth, elevation]) => place(azimuth, elevation).join(" ")).join("L");
  return svg("path", { d: `M${text}`, class: sunlit ? "t-sky__pass" : "t-sky__pass is-dark" });
}

/** A mark at the end of a pass. */
function ends(pass) {
  if (!pass) return [];
  const [, azimuth, elevation] = pass.curve.at(-1);
  const [cx, cy] = place(azimuth, elevation);
  return [svg("circle", { cx, cy, r: 2.5, class: "t-sky__end" })];
}

function words(pass) {
  if (!pass) return "Sky: no pass";
  const { aos, los, highest, station } = pass;
  const at = (point) => `azimuth ${point.azimuth_deg.toFixed(0)}°`;
  const top = `highest ${highest.elevation_deg.toFixed(0)}° at ${at(highest)}`;
  return `Sky over ${station}: rises at ${at(aos)}, ${top}, sets at ${at(los)}`;
}
