// What the page says of a ground, a satellite or an archive from which nothing comes any more.

import { utcToday } from "../dom.js";

/** No report from the ground since a time. */
export const noWord = ({ since }) => `no word from the ground since ${utcToday(since)} UTC`;

/** The same with what is to be done, where a ground is there that does not know this page. */
export const noWordAndWhy = (watch) =>
  watch.isRefused
    ? `${noWord(watch)}: it was started again; open the address that it printed`
    : noWord(watch);

/** No frame from a satellite that has sent; "" otherwise. */
export const noTelemetry = (link) =>
  link?.connected && link.silent ? `no telemetry since ${utcToday(link.heard_ms)}` : "";

/** An archive that takes nothing; "" otherwise. */
export const notArchived = (link) => {
  const since = link?.not_archived_since_ms ?? null;
  return since === null ? "" : `not archived since ${utcToday(since)}`;
};

/** All that is wrong with a satellite, in words. */
export const troubleOf = (link) =>
  [link.connected ? noTelemetry(link) : "link lost", notArchived(link)].filter(Boolean).join(", ");
