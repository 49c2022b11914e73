// How plots are drawn.

/** Renderers that stand in for a graphics card. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/**
 * Lets plots be drawn in 2D where WebGL is drawn by software, which takes half a second and more for
 * full plots. Open MCT asks for WebGL first, and takes 2D if there is none.
 */
export function drawPlotsIn2DWithoutGraphicsCard() {
  if (!SOFTWARE.test(renderer())) return;
  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    const isPlot = this.classList.contains("js-main-canvas") && kind !== "2d";
    return isPlot ? null : getContext.call(this, kind, ...rest);
  };
}

/** What draws WebGL, in its own words; "" without WebGL. */
function renderer() {
  const gl = document.createElement("canvas").getContext("webgl");
  if (!gl) return "";
  const about = gl.getExtension("WEBGL_debug_renderer_info");
  const name = gl.getParameter(about?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER);
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return name;
}
