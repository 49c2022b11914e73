// Open MCT for those who have no mouse, or hear the page: what is clicked has keys, roles are whole.

import { every } from "../dom.js";

const LOOK_MS = 500;
const OPTIONS = "ul:is(.js-plot-options-browse, .js-legend-properties)";

/** Elements by selector, and the role that they have. */
const ROLES = [
  [".l-pane__handle", "separator"],
  [".c-location[role=navigation]", "list"],
  ["li.grid-row[role=grid]", "row"],
  ["ul.grid-properties:has(> li[role=row])", "grid"],
  [`${OPTIONS}, ${OPTIONS} > li`, "none"],
];

/** What Open MCT lets click, but not reach: names in the tree, the time conductor, menus. */
const CLICKED = ".c-tree__item__label, .c-compact-tc__gear, .c-menu [role=menuitem]";

/** Elements come and go: each look mends those that are there. */
export function makeReachable() {
  every(LOOK_MS, mend, new AbortController().signal);
  document.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" || !event.target.matches(CLICKED)) return;
    event.preventDefault();
    event.target.click();
  });
}

function mend() {
  for (const [selector, role] of ROLES)
    for (const element of document.querySelectorAll(selector))
      if (element.getAttribute("role") !== role) element.setAttribute("role", role);
  for (const element of document.querySelectorAll(CLICKED)) {
    element.tabIndex = 0;
    if (!element.role) element.role = "link";
  }
  // The box is what is switched, not the picture beside it; several have the same id.
  for (const picture of document.querySelectorAll(".c-toggle-switch__slider[role=switch]")) {
    const box = picture.previousElementSibling;
    box.setAttribute("aria-label", picture.getAttribute("aria-label"));
    box.removeAttribute("id");
    picture.removeAttribute("role");
    picture.removeAttribute("aria-label");
  }
}
