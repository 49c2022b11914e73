// The alarms in the top bar: how many call for somebody, a way to their list, a word when one comes.

import { h } from "../dom.js";
import { SEVERITY_SIGNS } from "../limits.js";
import { ALARMS_PATH } from "./objects.js";

export function installAlarmIndicator(openmct, alarms) {
  const text = h("span", { class: "t-alarms__counts" });
  const button = h("a", { class: "t-alarms__indicator", href: ALARMS_PATH }, text);
  // Read out when it changes, and not shown: the counts are.
  const spoken = h("span", { class: "t-spoken", role: "status", "aria-live": "polite" });
  const element = h("div", { class: "t-link" }, button, spoken);
  openmct.indicators.add({
    element,
    key: "torquer.alarms",
    priority: openmct.priority.HIGH + 1,
  });
  const draw = () => {
    const counts = alarms.counts();
    const words = alarms.isKnown ? countsInWords(counts) : "? alarms unknown";
    const worst = counts.alarm ? "alarm" : counts.warning ? "warning" : "none";
    element.dataset.severity = alarms.isKnown ? worst : "warning";
    button.title = `${words}, not acknowledged; ${counts.shelved} shelved`;
    button.setAttribute("aria-label", `Alarms: ${button.title}`);
    if (text.textContent === words) return;
    text.textContent = words;
    spoken.textContent = alarms.isKnown ? `${words} not acknowledged` : words;
  };
  alarms.listen(draw);
  draw();
}

function countsInWords({ alarm, warning }) {
  if (!alarm && !warning) return "no alarms";
  const several = (count, word) =>
    count ? `${SEVERITY_SIGNS[word]} ${count} ${word}${count === 1 ? "" : "s"}` : null;
  return [several(alarm, "alarm"), several(warning, "warning")].filter(Boolean).join("  ");
}
