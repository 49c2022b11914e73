// Says that what is shown is old: of the whole page where the ground is silent, else of a satellite.

import { every, h, utcToday } from "../dom.js";

const LOOK_MS = 500;

/** What the page says where no word comes from the ground. */
export const noWord = (since) => `no word from the ground since ${utcToday(since)} UTC`;

export function installStaleness(satellites, live, watch) {
  const banner = h("p", { class: "t-silence", role: "alert" });
  document.body.append(banner);
  const root = document.documentElement;
  watch.on((since) => {
    root.classList.toggle("is-silent", since !== null);
    banner.textContent = since === null ? "" : noWord(since);
  });
  const silent = new Map();
  live.on("links", (links) => links.forEach((link) => silent.set(link.satellite, isOld(link))));
  // Views come and go: each look finds those that are open.
  const mark = () => {
    for (const view of document.querySelectorAll(".t-view[data-satellite]"))
      view.classList.toggle("is-silent", silent.get(view.dataset.satellite) ?? false);
  };
  every(LOOK_MS, mark, new AbortController().signal);
}

const isOld = ({ connected, silent }) => silent || !connected;
