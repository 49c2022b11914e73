// Narrow screens: the tree is folded unless it is asked for, and again once something is chosen.

const NARROW = "(max-width: 700px)";
const COLLAPSE = ".l-shell__pane-tree:not(.l-pane--collapsed) .l-pane__collapse-button";

export const isNarrow = () => matchMedia(NARROW).matches;

/** Parameters of an address with which Open MCT begins. */
export const paneParameters = () => (isNarrow() ? "hideInspector=true&hideTree=true" : "hideInspector=true");

/** Folds the tree on a narrow screen, now and after each choice. */
export function foldTree(openmct) {
  const fold = () => isNarrow() && document.querySelector(COLLAPSE)?.click();
  openmct.on("start", () => requestAnimationFrame(fold));
  openmct.router.on("afterNavigation", fold);
}
