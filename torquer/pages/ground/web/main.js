// Start: asks for the satellites, joins Open MCT to the server's routes, opens the first view.

import { h } from "./dom.js";
import { askAgain, followOpenSatellite, installTime } from "./mct/clocks.js";
import { installAlarmIndicator } from "./mct/alarm_indicator.js";
import { installExport } from "./mct/export.js";
import { installFormats } from "./mct/formats.js";
import { installIndicators } from "./mct/indicators.js";
import { foldTree, paneParameters } from "./mct/narrow.js";
import { installNextPass } from "./mct/next_pass.js";
import { installStaleness } from "./mct/staleness.js";
import { installObjects, NAMESPACE, overviewPath } from "./mct/objects.js";
import { drawPlotsIn2D } from "./mct/plots.js";
import { makeReachable } from "./mct/reach.js";
import { Telemetry } from "./mct/telemetry.js";
import { followModes } from "./limits.js";
import { latencyMeter } from "./measure.js";
import { AlarmStore } from "./net/alarms.js";
import { get } from "./net/api.js";
import { Live } from "./net/live.js";
import { askRole } from "./net/role.js";
import { Rows } from "./net/rows.js";
import { Watch } from "./net/watch.js";
import { satellitesOf } from "./satellites.js";
import { installViews } from "./views/all.js";

/** Where Open MCT finds its worker. */
const ASSETS = "/vendor/openmct/";

async function start() {
  const [described] = await Promise.all([get("/api/satellites"), askRole()]);
  const satellites = satellitesOf(described);
  if (!satellites.size) throw new Error("The server knows no satellite.");
  const live = new Live();
  const rows = new Rows(live);
  const alarms = new AlarmStore(satellites, live);
  const watch = new Watch(live);
  const openmct = window.openmct;

  drawPlotsIn2D();
  openmct.setAssetPath(ASSETS);
  openmct.install(openmct.plugins.LocalStorage());
  openmct.install(openmct.plugins.MyItems("My layouts"));
  installTime(openmct, satellites, rows);
  installFormats(openmct, satellites);
  installObjects(openmct, satellites);
  new Telemetry(openmct, satellites, rows, latencyMeter()).install();
  installExport(openmct, satellites);
  installViews(openmct, { satellites, live, rows, alarms });
  installAlarmIndicator(openmct, alarms);
  installIndicators(openmct, satellites, live, rows, watch);
  installNextPass(openmct, satellites);
  installStaleness(satellites, live, watch);
  followOpenSatellite(openmct, satellites);
  foldTree(openmct);
  makeReachable();
  live.on("again", () => askAgain(openmct));

  repairAddress(openmct, satellites);
  unfoldTree(satellites);
  openmct.start(document.getElementById("page"));
  live.connect();
  followModes(satellites, rows);
  alarms.askAll();
}

/** An address without a view opens the first overview; a clock that is gone would stop Open MCT. */
function repairAddress(openmct, satellites) {
  const [path, query] = location.hash.split("?");
  const clock = new URLSearchParams(query).get("tc.mode");
  const isKnown = !clock || clock === "fixed" || openmct.time.clocks.has(clock);
  if (path.length > 2 && isKnown) return;
  const [first] = satellites.values();
  location.hash = path.length > 2 ? path : `${overviewPath(first)}?${paneParameters()}`;
}

/** Shows the views of the first satellite in the tree, until the user folds and unfolds it. */
function unfoldTree(satellites) {
  const [first] = satellites.values();
  const key = "mct-tree-expanded";
  if (!localStorage.getItem(key))
    localStorage.setItem(key, JSON.stringify([`/browse/${NAMESPACE}:${first.key}`]));
}

start().catch((error) => {
  document.getElementById("page").replaceChildren(h("p", { class: "t-failure" }, error.message));
  console.error(error);
});
