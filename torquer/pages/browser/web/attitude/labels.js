// Words at points of the scene, as HTML above the canvas.

import { Vector3 } from "/vendor/three/three.min.js";
import { h } from "../dom.js";

export class Labels {
  #labels;

  /** `labels`: `{at, text, colour}`, `at` an object of the scene. */
  constructor(box, labels) {
    this.#labels = labels.map(({ at, text, colour }) => {
      const element = h("span", { class: "t-attitude__label" }, text);
      element.style.color = colour;
      box.append(element);
      return { at, element };
    });
  }

  /** Where the objects are seen; to be called after drawing. */
  place(camera, width, height) {
    const point = new Vector3();
    for (const { at, element } of this.#labels) {
      at.getWorldPosition(point).project(camera);
      element.hidden = !isShown(at) || point.z > 1;
      const [x, y] = [((point.x + 1) / 2) * width, ((1 - point.y) / 2) * height];
      element.style.transform = `translate(-50%, -50%) translate(${x}px, ${y}px)`;
    }
  }
}

function isShown(object) {
  for (let one = object; one; one = one.parent) if (!one.visible) return false;
  return true;
}
