// How plots are drawn: lines with gaps, marks for what is infinite and what stands alone.

/** Half the width of a mark at the edge, and its height [px]. */
const MARK = { half: 4, height: 7 };
/** Width of the mark of a place that no line leads to [px]. */
const DOT = 4;

/**
 * Lets plots be drawn in 2D: WebGL draws lines through what is not finite as the graphics card
 * likes, and without one takes half a second and more for full plots. Open MCT asks for WebGL
 * first, and takes 2D if there is none.
 */
export function drawPlotsIn2D() {
  const { getContext } = HTMLCanvasElement.prototype;
  const ready = new WeakSet();
  HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    const isPlot = this.classList.contains("js-main-canvas");
    if (isPlot && kind !== "2d") return null;
    const context = getContext.call(this, kind, ...rest);
    if (isPlot && !ready.has(context)) {
      ready.add(context);
      interruptLines(context);
    }
    return context;
  };
}

/**
 * Interrupts the lines of a context where a place is not finite, which 2D would leave out. Above
 * and below, where it is infinite, a triangle at the edge points to it. A place between two
 * interruptions, of which no line would be drawn, is a dot.
 */
function interruptLines(context) {
  const { moveTo, lineTo, stroke } = context;
  let isInterrupted = false;
  let infinite = [];
  let lone = null;
  let dots = [];
  const isPlace = (x, y) => {
    if (Number.isFinite(x) && Math.abs(y) === Infinity) infinite.push([x, y]);
    return Number.isFinite(x) && Number.isFinite(y);
  };
  const begin = (x, y) => {
    moveTo.call(context, x, y);
    lone = [x, y];
  };
  const end = () => {
    if (lone) dots.push(lone);
    lone = null;
  };
  context.moveTo = (x, y) => {
    end();
    isInterrupted = !isPlace(x, y);
    if (!isInterrupted) begin(x, y);
  };
  context.lineTo = (x, y) => {
    const isThere = isPlace(x, y);
    if (isThere && isInterrupted) begin(x, y);
    else if (isThere) lineTo.call(context, x, y);
    if (isThere && !isInterrupted) lone = null;
    if (!isThere) end();
    isInterrupted = !isThere;
  };
  context.stroke = (...path) => {
    end();
    stroke.apply(context, path);
    for (const [x, y] of infinite) context.fill(triangle(x, y < 0 ? 0 : context.canvas.height));
    for (const [x, y] of dots) context.fillRect(x - DOT / 2, y - DOT / 2, DOT, DOT);
    infinite = [];
    dots = [];
  };
}

/** A triangle that points to the upper edge (y = 0) or to the lower one. */
function triangle(x, y) {
  const path = new Path2D();
  const base = y === 0 ? MARK.height : y - MARK.height;
  path.moveTo(x, y);
  path.lineTo(x - MARK.half, base);
  path.lineTo(x + MARK.half, base);
  path.closePath();
  return path;
}
