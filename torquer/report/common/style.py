"""Style and script of the HTML report."""

CSS = """
:root { color-scheme: light dark; --ink: #22262b; --soft: #5d6670; --paper: #f5f6f7;
  --card: #ffffff; --line: #dfe3e7; --note: #fff6df; --note-line: #e3b341; }
@media (prefers-color-scheme: dark) { :root { --ink: #dde2e7; --soft: #9aa4ae; --paper: #14171a;
  --card: #1d2125; --line: #343a41; --note: #2d2815; --note-line: #9a7a20; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; }
main { max-width: 68rem; margin: 0 auto; padding: 1.5rem 1rem 3rem; }
h1 { font-size: 1.7rem; margin: 0; overflow-wrap: anywhere; }
h2 { font-size: 1.15rem; margin: 0 0 .5rem; }
h3 { font-size: .95rem; font-weight: 600; margin: 1rem 0 0; }
p { color: var(--soft); margin: .2rem 0 .6rem; }
header { margin-bottom: 1rem; }
.columns { display: grid; gap: 1rem; grid-template-columns: repeat(auto-fit, minmax(19rem, 1fr)); }
section { background: var(--card); border: 1px solid var(--line); border-radius: 8px;
  padding: 1rem 1.1rem; min-width: 0; }
.card, .notes { margin: 1rem 0; }
.notes { background: var(--note); border-color: var(--note-line); }
.notes ul { margin: 0; padding-left: 1.2rem; }
table { border-collapse: collapse; width: 100%; font-size: .92rem; }
th, td { text-align: left; padding: .28rem 0; border-bottom: 1px solid var(--line);
  vertical-align: top; }
th { font-weight: 400; color: var(--soft); padding-right: 1rem; }
th.inset { padding-left: 1rem; }
td { font-variant-numeric: tabular-nums; padding-right: .8rem; overflow-wrap: anywhere; }
tr:last-child th, tr:last-child td { border-bottom: 0; }
pre { overflow-x: auto; font-size: .82rem; line-height: 1.45; margin: 0 0 1.2rem; padding: .8rem;
  background: var(--paper); border-radius: 6px; }
img { max-width: 100%; }
.plot { width: 100%; }
@media (max-width: 40rem) { main { padding: .8rem .4rem 2rem; } section { padding: .8rem .6rem; } }
"""

SCRIPT = """
(() => {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const narrow = innerWidth < 640;
  // nothing leaves this page: newer plotly would offer to send a picture to a server
  const config = { displaylogo: false, responsive: true, showSendToCloud: false,
    plotlyServerURL: "", displayModeBar: narrow ? false : "hover",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "zoomIn2d", "zoomOut2d", "tableRotation",
      "resetCameraLastSave3d"] };
  const linked = [];
  let shared = null, passing = false;

  const colours = () => dark.matches
    ? { "font.color": "#c3cad1", "hoverlabel.bgcolor": "#262b30" }
    : { "font.color": "#444b52", "hoverlabel.bgcolor": "#ffffff" };

  // a zoom in one plot of the whole run applies to all others
  function follow(box, event) {
    if (passing) return;
    if (event["xaxis.range[0]"] !== undefined)
      shared = [event["xaxis.range[0]"], event["xaxis.range[1]"]];
    else if (event["xaxis.range"]) shared = event["xaxis.range"];
    else if (event["xaxis.autorange"]) shared = null;
    else return;
    passing = true;
    Promise.all(linked.map(other =>
      Plotly.relayout(other, { "xaxis.range": (shared || other.whole).slice() })))
      .finally(() => { passing = false; });
  }

  function narrowed(figure) {
    if (figure.frames || figure.layout.scene) return { height: 460 };
    figure.layout.margin.l = 46;
    for (const trace of figure.data) delete trace.colorbar, trace.showscale = false;
    if (figure.layout.xaxis.dtick === 30) figure.layout.xaxis.dtick = 60;
    return { height: Math.min(figure.layout.height, 300) };
  }

  async function draw(box) {
    const figure = JSON.parse(box.querySelector("script").textContent);
    const stage = document.createElement("div");
    box.append(stage);
    if (narrow) Object.assign(figure.layout, narrowed(figure));
    // the animation's buttons take the place of plotly's
    figure.config = figure.frames ? { ...config, displayModeBar: false } : config;
    await Plotly.newPlot(stage, figure);
    stage.classList.add("drawn");
    box.style.minHeight = "";
    await Plotly.relayout(stage, colours());
    if (!box.hasAttribute("data-linked")) return;
    stage.whole = figure.layout.xaxis.range.slice();
    linked.push(stage);
    if (shared) Plotly.relayout(stage, { "xaxis.range": shared.slice() });
    stage.on("plotly_relayout", event => follow(stage, event));
  }

  const waiting = new Set(document.querySelectorAll(".plot"));
  const show = box => { if (waiting.delete(box)) draw(box); };
  const watch = new IntersectionObserver(
    entries => entries.forEach(e => { if (e.isIntersecting) show(e.target); }),
    { rootMargin: "600px" });
  waiting.forEach(box => watch.observe(box));
  addEventListener("beforeprint", () => [...waiting].forEach(show));
  dark.addEventListener("change", () =>
    document.querySelectorAll(".drawn").forEach(stage => Plotly.relayout(stage, colours())));
})();
"""
