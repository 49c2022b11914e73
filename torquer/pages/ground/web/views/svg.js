// Elements of SVG.

const NAMES = "http://www.w3.org/2000/svg";

/** An element with attributes and children. */
export function svg(tag, attributes, ...children) {
  const element = document.createElementNS(NAMES, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}
