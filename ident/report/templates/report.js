"use strict";
(() => {
  const figures = JSON.parse(document.getElementById("figures").textContent);
  // A finger that drags over a figure wants to scroll the page, a mouse that drags wants to zoom.
  const touch = window.matchMedia("(pointer: coarse), (hover: none)").matches;
  const config = {
    displaylogo: false,
    displayModeBar: touch ? false : "hover",
    responsive: true,
    modeBarButtons: [["zoom2d", "pan2d", "resetScale2d", "toImage"]],
  };
  const axis = { automargin: true, showline: false, zeroline: false, zerolinewidth: 1 };
  const base = {
    autosize: true,
    showlegend: false,
    dragmode: touch ? false : "zoom",
    margin: { l: 52, r: 10, t: 12, b: 42 },
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: "system-ui, -apple-system, Segoe UI, Roboto, Arial, sans-serif", size: 12 },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: "#7d8794", activecolor: "#4a86c9" },
    legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0 },
  };
  const draw = (key) => {
    const { data, layout } = figures[key];
    const axes = {};
    for (const name of Object.keys(layout).filter((entry) => /^[xy]axis/.test(entry))) {
      axes[name] = { ...axis, ...layout[name] };
    }
    return Plotly.newPlot(key, data, { ...base, ...layout, ...axes }, config);
  };
  const keys = Object.keys(figures);
  keys.forEach(draw);

  // Paper has its own columns; the browser lays them out only after this event, so they are asked for here.
  const fit = (width) => keys.map((key) => document.getElementById(key)).forEach((plot) => {
    Plotly.relayout(plot, { width: width(plot), autosize: true });
  });
  window.addEventListener("beforeprint", () => {
    document.documentElement.classList.add("paper");
    fit((plot) => plot.parentElement.clientWidth);
  });
  window.addEventListener("afterprint", () => {
    document.documentElement.classList.remove("paper");
    fit(() => null);
  });
})();
