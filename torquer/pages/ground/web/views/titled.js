// Lines of tables whose cells know their titles: where there is no room for columns CSS shows these.

import { h } from "../dom.js";

/** A line of a table that folds, with its cells in the order of the titles. */
export const titledLine = (titles, cells, properties = {}) =>
  h("tr", properties, cells.map((cell, i) => named(cell, titles[i])));

function named(cell, title) {
  const element = cell instanceof HTMLTableCellElement ? cell : h("td", {}, cell);
  element.dataset.title = title;
  return element;
}
