// Texts of the page in the language of the reader.

import { words } from "/messages.js";

/** A text, with `values` put in for the `{names}` in it. */
export function t(text, values = {}) {
  return (words[text] ?? text).replace(/\{(\w+)\}/g, (_, name) => values[name]);
}
