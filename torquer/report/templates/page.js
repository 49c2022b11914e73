(() => {
  // what `torquer.report.common.html.embed` was given
  async function unpacked(text) {
    const bytes = Uint8Array.from(atob(text), sign => sign.charCodeAt(0));
    const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(plain).text();
  }

  const dark = matchMedia("(prefers-color-scheme: dark)");
  const narrow = innerWidth < 640;
  // nothing leaves this page: newer plotly would offer to send a picture to a server
  const config = { displaylogo: false, responsive: true, showSendToCloud: false,
    plotlyServerURL: "", displayModeBar: narrow ? false : "hover",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "zoomIn2d", "zoomOut2d", "tableRotation",
      "resetCameraLastSave3d"] };
  const texts = new Map(), near = new Set(), linked = [];
  let shared = null, passing = 0;

  const colours = () => dark.matches
    ? { "font.color": "#c3cad1", "hoverlabel.bgcolor": "#262b30" }
    : { "font.color": "#444b52", "hoverlabel.bgcolor": "#ffffff" };

  // a zoom in one plot of the whole run applies to all others: at once to those near the window,
  // to the rest when the browser is idle
  function follow(stage, event) {
    if (passing) return;
    if (event["xaxis.range[0]"] !== undefined)
      shared = [event["xaxis.range[0]"], event["xaxis.range[1]"]];
    else if (event["xaxis.range"]) shared = event["xaxis.range"];
    else if (event["xaxis.autorange"]) shared = null;
    else return;
    if (shared) stage.zoom = shared;
    linked.filter(other => near.has(other.parentNode)).forEach(zoomed);
    whenIdle();
  }

  function zoomed(stage) {
    if (stage.zoom === shared) return;
    stage.zoom = shared;
    passing += 1;
    Plotly.relayout(stage, { "xaxis.range": (shared || stage.whole).slice() })
      .finally(() => { passing -= 1; });
  }

  function narrowed(figure) {
    if (figure.frames || figure.layout.scene) return { height: 460 };
    figure.layout.margin.l = 46;
    for (const trace of figure.data) delete trace.colorbar, trace.showscale = false;
    if (figure.layout.xaxis.dtick === 30) figure.layout.xaxis.dtick = 60;
    return { height: Math.min(figure.layout.height, figure.layout.yaxis2 ? 480 : 300) };
  }

  // arrows move, + and - zoom, 0 shows all; in an animation arrows step and the space bar plays
  function steer(event, stage, figure) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const done = figure.frames && figure.frames.length ? animated(event.key, stage, figure)
      : figure.layout.xaxis ? moved(event.key, stage) : turned(event.key, stage);
    if (done) event.preventDefault();
  }

  function moved(key, stage) {
    const [low, high] = stage.layout.xaxis.range, tenth = 0.1 * (high - low);
    const range = {
      ArrowLeft: [low - tenth, high - tenth], ArrowRight: [low + tenth, high + tenth],
      "+": [low + tenth, high - tenth], "-": [low - tenth, high + tenth],
      "0": stage.whole,
    }[key];
    if (range) Plotly.relayout(stage, { "xaxis.range": range.slice() });
    else if (key === "0") Plotly.relayout(stage, { "xaxis.autorange": true });
    return Boolean(range) || key === "0";
  }

  function animated(key, stage, figure) {
    const last = figure.frames.length - 1, now = stage.frame || 0;
    const at = { ArrowLeft: now - 1, ArrowRight: now + 1, Home: 0, End: last }[key];
    if (key === " ") {
      stage.playing = !stage.playing;
      Plotly.animate(stage, stage.playing ? null : [null], { mode: "immediate",
        fromcurrent: true, frame: { duration: 110, redraw: true }, transition: { duration: 0 } });
      return true;
    }
    if (at === undefined) return turned(key, stage);
    stage.frame = Math.min(Math.max(at, 0), last);
    Plotly.animate(stage, [String(stage.frame)], { mode: "immediate",
      frame: { duration: 0, redraw: true }, transition: { duration: 0 } });
    return true;
  }

  // up and down turn the view of a plot in space
  function turned(key, stage) {
    const scene = stage.layout.scene, step = { ArrowUp: 0.15, ArrowDown: -0.15 }[key];
    if (!scene || step === undefined) return false;
    const eye = { ...scene.camera.eye }, c = Math.cos(step), s = Math.sin(step);
    Plotly.relayout(stage, { "scene.camera.eye":
      { x: c * eye.x - s * eye.y, y: s * eye.x + c * eye.y, z: eye.z } });
    return true;
  }

  // without a pause, so that a plot is on the page when this returns: printing waits for nothing
  function draw(box) {
    if (!waiting.delete(box)) return;
    const figure = JSON.parse(texts.get(box)), stage = document.createElement("div");
    texts.delete(box);
    box.append(stage);
    if (narrow) Object.assign(figure.layout, narrowed(figure));
    for (const [key, colour] of Object.entries(colours())) {
      const [part, name] = key.split(".");
      figure.layout[part] = { ...figure.layout[part], [name]: colour };
    }
    // the animation's buttons take the place of plotly's
    figure.config = figure.frames ? { ...config, displayModeBar: false } : config;
    // what the box says of the plot is said once: not again by what plotly draws
    stage.setAttribute("aria-hidden", "true");
    // plotly goes on with this layout as its own
    const { xaxis } = figure.layout;
    stage.whole = xaxis && xaxis.range && xaxis.range.slice();
    const drawn = Plotly.newPlot(stage, figure);
    box.addEventListener("keydown", event => steer(event, stage, figure));
    box.setAttribute("data-drawn", "");
    stage.classList.add("drawn");
    box.style.minHeight = "";
    if (box.hasAttribute("data-linked")) drawn.then(() => link(stage));
  }

  function link(stage) {
    stage.zoom = null;
    linked.push(stage);
    zoomed(stage);
    stage.on("plotly_relayout", event => follow(stage, event));
  }

  // what is not near the window is drawn in idle moments, one plot in each: a browser prints what
  // is on the page. What a closed element hides has no width yet and waits until it is opened.
  const idle = window.requestIdleCallback
    ? step => requestIdleCallback(step, { timeout: 1000 }) : step => setTimeout(step, 30);
  let asked = false;

  function whenIdle() {
    if (asked) return;
    asked = true;
    idle(() => {
      asked = false;
      const box = shown()[0], stage = linked.find(other => other.zoom !== shared);
      if (!box && !stage) return;
      whenIdle();
      if (box) draw(box); else zoomed(stage);
    });
  }

  const shown = () => [...waiting].filter(box => !box.closest("details:not([open])"));

  async function load() {
    const script = document.createElement("script");
    script.textContent = await unpacked(document.getElementById("plotly").textContent);
    document.head.append(script);
  }

  // a link to what is folded opens it
  function open() {
    const target = location.hash && document.getElementById(location.hash.slice(1));
    const folded = target && target.querySelector(":scope > details");
    if (folded) folded.open = true;
  }
  addEventListener("hashchange", open);
  open();

  const plots = document.querySelectorAll(".plot");
  if (!("DecompressionStream" in window)) {
    plots.forEach(box => { box.textContent = "This plot needs a browser of 2023 or later."; });
    return;
  }
  const waiting = new Set(plots);
  const unpack = async box =>
    texts.set(box, await unpacked(box.querySelector("script").textContent));

  Promise.all([load(), ...[...plots].map(unpack)]).then(() => {
    const watch = new IntersectionObserver(
      entries => entries.forEach(({ isIntersecting, target }) => {
        near[isIntersecting ? "add" : "delete"](target);
        if (isIntersecting) draw(target);
        linked.filter(stage => near.has(stage.parentNode)).forEach(zoomed);
      }),
      { rootMargin: "600px" });
    plots.forEach(box => watch.observe(box));
    addEventListener("beforeprint", () => { shown().forEach(draw); linked.forEach(zoomed); });
    addEventListener("toggle", whenIdle, true);
    dark.addEventListener("change", () =>
      document.querySelectorAll(".drawn").forEach(stage => Plotly.relayout(stage, colours())));
    whenIdle();
  });
})();
