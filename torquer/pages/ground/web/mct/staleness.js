// Says that what is shown is old: of the whole page where the ground is silent, else of a satellite.

import { every, h } from "../dom.js";
import { noWordAndWhy, troubleOf } from "./trouble.js";

const LOOK_MS = 500;

export function installStaleness(satellites, live, watch) {
  const banner = h("p", { class: "t-silence", role: "alert" });
  document.body.append(banner);
  const links = new Map();
  const show = () => showBanner(banner, watch, troubles(satellites, links));
  watch.on(show);
  live.on("links", (received) => {
    received.forEach((link) => links.set(link.satellite, link));
    show();
  });
  // Views come and go: each look finds those that are open.
  const mark = () => {
    for (const view of document.querySelectorAll(".t-view[data-satellite]"))
      view.classList.toggle("is-silent", isOld(links.get(view.dataset.satellite)));
  };
  every(LOOK_MS, mark, new AbortController().signal);
}

/** The banner of a silent ground; that of a satellite is for windows without a status line. */
function showBanner(banner, watch, troubles) {
  const { since } = watch;
  const text = since === null ? troubles : noWordAndWhy(watch);
  if (banner.textContent !== text) banner.textContent = text;
  document.documentElement.classList.toggle("is-silent", since !== null);
  document.documentElement.classList.toggle("is-troubled", since === null && text !== "");
}

const troubles = (satellites, links) =>
  [...links.values()]
    .map((link) => [satellites.get(link.satellite)?.name, troubleOf(link)])
    .filter(([, trouble]) => trouble)
    .map((parts) => parts.join(": "))
    .join("; ");

const isOld = (link) => link !== undefined && (link.silent || !link.connected);
