// The diagram of the mode table with the present states lit.

import { h } from "../dom.js";
import { followStates, modesOf, RegionList } from "./regions.js";

/** Styles of the diagram; it is drawn for white paper, and its own styles stay in a shadow tree. */
const STYLE = `
  :host { display: block; background: white; }
  svg { display: block; }
  svg.is-fitted { width: 100%; height: auto; }
  rect[data-state].is-present, .is-present rect { fill: #ffd54a; stroke: #b26a00; stroke-width: 3; }
  @media (prefers-reduced-motion: no-preference) { rect { transition: fill 0.3s; } }
`;

export async function showModes(element, context) {
  const { regions, svg } = await modesOf(context.satellite, context.signal);
  const diagram = new Diagram(svg);
  const list = new RegionList(regions, (i) => diagram.scrollTo(regions[i].name));
  const fit = h("input", { type: "checkbox", onchange: () => diagram.fit(fit.checked) });
  element.append(
    h(
      "div",
      { class: "t-modes" },
      h(
        "div",
        { class: "t-modes__list t-scroll", tabindex: 0 },
        h("p", { class: "t-note" }, "A click on a region shows its present state."),
        list.element,
        h("label", { class: "t-modes__fit" }, fit, " fit to the width"),
      ),
      h("div", { class: "t-modes__diagram t-scroll", tabindex: 0 }, diagram.element),
    ),
  );
  await followStates(regions, context, (states) => {
    list.show(states);
    diagram.show(regions, states);
  });
}

class Diagram {
  element = h("div", {
    class: "t-diagram",
    role: "img",
    "aria-label": "Diagram of the mode table",
  });
  #svg;

  constructor(text) {
    const shadow = this.element.attachShadow({ mode: "open" });
    const found = new DOMParser().parseFromString(text, "image/svg+xml").documentElement;
    this.#svg = document.importNode(found, true);
    // After the diagram's own style, which it is to replace.
    shadow.append(this.#svg, h("style", {}, STYLE));
  }

  show(regions, states) {
    const present = new Set(regions.map(({ name }, i) => `${name}/${states[i]}`));
    for (const box of this.#svg.querySelectorAll("[data-region][data-state]")) {
      const { region, state } = box.dataset;
      box.classList.toggle("is-present", present.has(`${region}/${state}`));
    }
  }

  fit(isFitted) {
    this.#svg.classList.toggle("is-fitted", isFitted);
  }

  scrollTo(region) {
    const boxes = [...this.#svg.querySelectorAll("[data-region]")];
    const ofRegion = boxes.filter((box) => box.dataset.region === region);
    const present = ofRegion.find((box) => box.classList.contains("is-present")) ?? ofRegion[0];
    present?.scrollIntoView({ block: "center", inline: "nearest" });
  }
}
