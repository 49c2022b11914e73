// Times as they are shown: UTC or those of this machine's zone, always marked; one switch for all.

import { h, utc } from "./dom.js";

const KEY = "torquer-zone";
const LOCAL = "local";

/** Whether times are shown in the zone of this machine. */
export const isLocal = () => localStorage.getItem(KEY) === LOCAL;

/** Text of a time in ms since 1970 to the second, with its mark; "" for none. */
export function inZone(milliseconds) {
  if (milliseconds === null || milliseconds === undefined) return "";
  const date = new Date(milliseconds);
  if (Number.isNaN(date.getTime())) return "invalid time";
  if (!isLocal()) return `${utc(milliseconds)} UTC`;
  const shift = -date.getTimezoneOffset();
  const [hours, minutes] = [Math.abs(shift) / 60, Math.abs(shift) % 60].map((part) =>
    String(Math.floor(part)).padStart(2, "0"),
  );
  const text = utc(milliseconds + shift * 60_000);
  return `${text} ${shift < 0 ? "−" : "+"}${hours}:${minutes} local`;
}

/** The same without the date where it is today's. */
export function inZoneToday(milliseconds) {
  const text = inZone(milliseconds);
  return text.slice(0, 10) === inZone(Date.now()).slice(0, 10) ? text.slice(11) : text;
}

/** A button that changes between both; `changed` is called after each change. */
export function zoneSwitch(changed) {
  const button = h("button", { type: "button", class: "t-zone" });
  const show = () => {
    button.textContent = `Times: ${isLocal() ? "local" : "UTC"}`;
    button.title = isLocal() ? "Show all times in UTC" : "Show all times in the zone of this machine";
  };
  button.onclick = () => {
    localStorage.setItem(KEY, isLocal() ? "UTC" : LOCAL);
    show();
    changed();
  };
  show();
  return button;
}

/** How long something is, in words. */
export function duration(milliseconds) {
  const s = Math.abs(milliseconds) / 1000;
  if (s < 120) return `${s.toFixed(1)} s`;
  if (s < 7200) return `${(s / 60).toFixed(1)} min`;
  if (s < 172_800) return `${(s / 3600).toFixed(1)} h`;
  const days = s / 86_400;
  return days < 730 ? `${days.toFixed(1)} days` : `${(days / 365.25).toFixed(1)} years`;
}
