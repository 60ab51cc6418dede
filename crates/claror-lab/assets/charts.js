"use strict";
// Interactive charts in place of the static ones. If one fails, its static one stays.
(() => {
  const charts = JSON.parse(document.getElementById("chart-data").textContent);
  const figures = [...document.querySelectorAll("figure.chart")];
  const SHAPES = ["circle", "square", "triangle-up", "diamond", "triangle-down", "cross"];
  const DASHES = [[1, 0], [7, 3], [2, 3], [9, 3, 2, 3]];
  /** A colour of the theme: variables themselves hold both, an element's colour is one. */
  const probe = document.createElement("span");
  probe.hidden = true;
  document.body.append(probe);
  const color = (name) => { probe.style.color = `var(${name})`; return getComputedStyle(probe).color; };
  const shape = (style) => SHAPES[(style + Math.floor(style / 6)) % 6];

  /** All marks of a chart as rows. */
  function rows(chart) {
    return chart.lines.flatMap((line) => line.marks.map((m) => ({
      line: line.label, setting: m.setting, joined: line.joined,
      x: m.x[0], xl: m.x[1], xh: m.x[2], y: m.y[0], yl: m.y[1], yh: m.y[2],
      xt: m.x_text, yt: m.y_text, seeds: m.seeds || "–", command: m.command || "–", front: m.front,
    })));
  }

  /** Ticks are those of the static charts; lesser ones are faint and have no label. */
  function encoded(axis, field) {
    const values = axis.ticks.map(([value]) => value);
    const labels = JSON.stringify(axis.ticks.map(([, text]) => text ?? ""));
    const label = `${labels}[indexof(${JSON.stringify(values)}, datum.value)]`;
    const faint = { condition: { test: `${label} === ''`, value: 0.45 }, value: 1 };
    return {
      field, type: "quantitative", title: axis.title,
      scale: { type: axis.log ? "log" : "linear", domain: axis.domain, nice: false, ...(axis.log ? {} : { zero: false }) },
      axis: { values, labelExpr: label, labelOverlap: false, gridOpacity: faint, tickOpacity: faint },
    };
  }

  function specification(chart) {
    const data = rows(chart);
    const domain = chart.lines.map((l) => l.label);
    const [ink, muted, grid] = ["--ink", "--muted", "--grid"].map(color);
    const scales = {
      color: { field: "line", type: "nominal", legend: null, scale: { domain, range: chart.lines.map((l) => color(`--series-${l.style % 6}`)) } },
      shape: { field: "line", type: "nominal", legend: null, scale: { domain, range: chart.lines.map((l) => shape(l.style)) } },
    };
    const [x, y] = [encoded(chart.x, "x"), encoded(chart.y, "y")];
    const tooltip = [
      { field: "line", title: "Series" }, { field: "setting", title: "Setting" },
      { field: "xt", title: chart.x.title }, { field: "yt", title: chart.y.title },
      { field: "seeds", title: "Seeds" }, { field: "command", title: "Command" },
    ];
    const layer = [];
    if (chart.front.length > 1) {
      layer.push({
        data: { values: chart.front.map(([x, y]) => ({ x, y })) },
        mark: { type: "line", interpolate: "step-after", strokeDash: [5, 4], strokeWidth: 1.2, color: muted },
        encoding: { x, y },
      });
    }
    if (!chart.y.log && chart.y.domain[0] < 0 && chart.y.domain[1] > 0) {
      layer.push({ data: { values: [{ zero: 0 }] }, mark: { type: "rule", color: muted, strokeWidth: 1.5 }, encoding: { y: { field: "zero", type: "quantitative" } } });
    }
    layer.push(
      {
        transform: [{ filter: "datum.joined" }],
        mark: { type: "line", strokeWidth: 1.8 },
        encoding: {
          x, y, color: scales.color,
          strokeDash: { field: "line", type: "nominal", legend: null, scale: { domain, range: chart.lines.map((l) => DASHES[l.style % DASHES.length]) } },
        },
      },
      { mark: { type: "rule", strokeWidth: 1.2 }, encoding: { x, y: { ...y, field: "yl" }, y2: { field: "yh" }, color: scales.color } },
      { mark: { type: "rule", strokeWidth: 1.2 }, encoding: { x: { ...x, field: "xl" }, x2: { field: "xh" }, y, color: scales.color } },
      { transform: [{ filter: "datum.front" }], mark: { type: "point", shape: "circle", size: 230, stroke: ink, strokeWidth: 1, filled: false }, encoding: { x, y } },
      { mark: { type: "point", filled: true, size: 75, opacity: 1 }, encoding: { x, y, color: scales.color, shape: scales.shape, tooltip } },
    );
    return {
      $schema: "https://vega.github.io/schema/vega-lite/v6.json",
      description: `${chart.title}. ${chart.caption}`,
      width: "container", height: 310, autosize: { type: "fit", contains: "padding" }, background: null,
      data: { values: data }, layer,
      config: {
        font: "system-ui, 'Segoe UI', 'Liberation Sans', Arial, sans-serif",
        view: { stroke: null },
        axis: { labelColor: ink, titleColor: ink, gridColor: grid, domainColor: ink, tickColor: muted, labelFontSize: 12, titleFontSize: 12.5, titleFontWeight: "normal", titlePadding: 8 },
      },
    };
  }

  const options = {
    renderer: "svg", ast: true,
    actions: false,
    tooltip: { theme: "custom" },
  };

  async function draw(figure, chart) {
    figure.classList.add("drawn");
    const live = figure.querySelector(".live");
    try {
      const old = live.claror;
      live.claror = await vegaEmbed(live, specification(chart), options);
      old?.finalize();
      live.removeAttribute("aria-hidden");
    } catch (error) {
      figure.classList.remove("drawn");
      console.error(error);
    }
  }

  /** Three times the size on the screen, for slides. */
  async function save(figure) {
    const link = document.createElement("a");
    link.href = await figure.querySelector(".live").claror.view.toImageURL("png", 3);
    link.download = `${figure.id}.png`;
    link.click();
  }
  for (const figure of figures) {
    const button = figure.querySelector(".save-png");
    button.hidden = false;
    button.addEventListener("click", () => save(figure));
  }

  let generation = 0;
  async function drawAll() {
    const mine = ++generation;
    for (const [i, figure] of figures.entries()) {
      if (mine !== generation) return;
      await draw(figure, charts[i]);
    }
    document.documentElement.dataset.charts = "drawn";
  }
  // report.js sets the theme at the start, and that draws the charts.
  document.addEventListener("themechange", drawAll);
})();
