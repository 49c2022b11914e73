// Views of our own, by the type of object that they show.

import { h } from "../dom.js";
import { TYPES } from "../mct/objects.js";
import { showAlarms } from "./alarms.js";
import { showCommandHistory } from "./command_history.js";
import { showCommands } from "./commands.js";
import { showGaps } from "./gaps.js";
import { showLog } from "./log.js";
import { showModes } from "./modes.js";
import { showPacket } from "./packet.js";
import { showPast } from "./past.js";
import { showSatellites } from "./satellites.js";
import { showPlan } from "./plan.js";
import { showStack } from "./stack.js";
import { showPasses } from "./passes.js";
import { showState } from "./state.js";

/** 3D needs three.js, which is loaded only where it is shown. */
const showAttitude = async (element, context) =>
  (await import("../attitude/view.js")).showAttitude(element, context);

const VIEWS = [
  { type: TYPES.attitude, name: "Attitude 3D", cssClass: "icon-object", show: showAttitude },
  { type: TYPES.modes, name: "Modes", cssClass: "icon-layers", show: showModes },
  { type: TYPES.commands, name: "Commands", cssClass: "icon-play", show: showCommands },
  { type: TYPES.stack, name: "Command stack", cssClass: "icon-list-view", show: showStack },
  { type: TYPES.plan, name: "Plan", cssClass: "icon-timeline", show: showPlan },
  { type: TYPES.history, name: "History", cssClass: "icon-history", show: showCommandHistory },
  { type: TYPES.log, name: "Log", cssClass: "icon-notebook", show: showLog },
  { type: TYPES.past, name: "Past", cssClass: "icon-clock", show: showPast },
  { type: TYPES.gaps, name: "Gaps", cssClass: "icon-brackets", show: showGaps },
  { type: TYPES.satellites, name: "Side by side", cssClass: "icon-layout", show: showSatellites },
  { type: TYPES.alarms, name: "Alarms", cssClass: "icon-bell", show: showAlarms },
  { type: TYPES.passes, name: "Passes", cssClass: "icon-map", show: showPasses },
  { type: TYPES.state, name: "State", cssClass: "icon-info", show: showState },
  { type: TYPES.packet, name: "Values", cssClass: "icon-list-view", show: showPacket },
];

/**
 * `show(element, context)` fills the element; `context` has the satellite, the object, the sources
 * of data, and a signal that is aborted when the view is closed.
 */
export function installViews(openmct, sources) {
  for (const { type, name, cssClass, show } of VIEWS)
    openmct.objectViews.addProvider({
      key: `${type}.view`,
      name,
      cssClass,
      canView: (object) => object.type === type,
      priority: () => openmct.priority.HIGH,
      view: (object) => viewOf(show, { openmct, object, ...sources }),
    });
}

function viewOf(show, context) {
  const closed = new AbortController();
  const satellite = context.satellites.get(context.object.satellite);
  return {
    show(element) {
      // Open MCT sets the classes of its own element.
      const box = h("div", { class: "t-view", "data-satellite": context.object.satellite });
      element.append(box);
      const shown = show(box, { ...context, satellite, signal: closed.signal });
      Promise.resolve(shown).catch((error) => failed(box, error, closed.signal));
    },
    destroy: () => closed.abort(),
  };
}

function failed(element, error, signal) {
  if (signal.aborted) return;
  element.replaceChildren(h("p", { class: "t-failure" }, error.message));
  console.error(error);
}
