// Draws the live figures of a page from the data beside them, once plotly's script is there. A figure that has been
// drawn hides its still picture on the screen; on paper and without a script the still picture stays.
(function () {
  "use strict";
  const config = {
    responsive: true,
    displaylogo: false,
    showSendToCloud: false,
    plotlyServerURL: "",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"],
  };

  function unpack(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  }

  function rounded(value) {
    return String(Number(value.toPrecision(4)));
  }

  function nearest(values, wanted) {
    let best = 0;
    values.forEach((value, at) => {
      if (Math.abs(value - wanted) < Math.abs(values[best] - wanted)) best = at;
    });
    return best;
  }

  function drawPlain(figure, data) {
    return Plotly.newPlot(figure.querySelector(".plot"), data.traces, data.layout, config);
  }

  // A map with a cursor: the curves along both its axes through the point under the cursor.
  function drawMap(figure, data) {
    const [map, alongY, alongX] = figure.querySelectorAll(".plot");
    const [sliderX, sliderY] = figure.querySelectorAll("input");
    const [saidX, saidY] = figure.querySelectorAll("output");
    const x = unpack(data.x);
    const sheets = data.sheets.map((packed) => {
      const y = unpack(packed.y), flat = unpack(packed.values);
      return { y, rows: Array.from(y, (_, row) => flat.subarray(row * x.length, (row + 1) * x.length)) };
    });
    const y = sheets[0].y; // the cursor's steps; the others show what they have nearest to it
    const at = { x: 0, y: 0 };
    const plain = (raw) => (data.logarithmic ? raw.map((value) => 10 ** value) : raw);
    const alongYof = (sheet) => plain(sheet.rows.map((row) => row[at.x]));
    const alongXof = (sheet) => plain(Array.from(sheet.rows[nearest(sheet.y, y[at.y])]));

    function cross() {
      const line = { color: "#fff", width: 1.5, dash: "dot" };
      return [
        { type: "line", line, x0: x[at.x], x1: x[at.x], yref: "paper", y0: 0, y1: 1 },
        { type: "line", line, y0: y[at.y], y1: y[at.y], xref: "paper", x0: 0, x1: 1 },
      ];
    }

    function say() {
      sliderX.value = at.x;
      sliderY.value = at.y;
      saidX.textContent = (rounded(x[at.x]) + " " + data.unit_x).trim();
      saidY.textContent = (rounded(y[at.y]) + " " + data.unit_y).trim();
    }

    let waiting = false;
    function moved() {
      say();
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        Plotly.relayout(map, { shapes: cross() });
        Plotly.restyle(alongY, { y: sheets.map(alongYof) });
        Plotly.restyle(alongX, { y: sheets.map(alongXof) });
      });
    }

    at.x = nearest(x, data.start[0]);
    at.y = nearest(y, data.start[1]);
    sliderX.max = x.length - 1;
    sliderY.max = y.length - 1;
    say();
    sliderX.addEventListener("input", () => { at.x = Number(sliderX.value); moved(); });
    sliderY.addEventListener("input", () => { at.y = Number(sliderY.value); moved(); });
    const traces = data.maps.map((one, n) => ({ ...one, x, y: sheets[n].y, z: sheets[n].rows }));
    const curvesY = sheets.map((sheet, n) => ({ ...data.curves[n], x: sheet.y, y: alongYof(sheet) }));
    const curvesX = sheets.map((sheet, n) => ({ ...data.curves[n], x, y: alongXof(sheet) }));
    return Promise.all([
      Plotly.newPlot(map, traces, { ...data.layout, shapes: cross() }, config),
      Plotly.newPlot(alongY, curvesY, data.layout_y, config),
      Plotly.newPlot(alongX, curvesX, data.layout_x, config),
    ]).then(() => {
      const follow = (event) => {
        at.x = nearest(x, event.points[0].x);
        at.y = nearest(y, event.points[0].y);
        moved();
      };
      map.on("plotly_hover", follow);
      map.on("plotly_click", follow);
    });
  }

  const drawn = Array.from(document.querySelectorAll("figure.live"), (figure) => {
    const data = JSON.parse(figure.querySelector("script").textContent);
    figure.classList.add("drawn"); // before drawing: a hidden plot has no width
    const draw = data.kind === "map" ? drawMap : drawPlain;
    return Promise.resolve().then(() => draw(figure, data)).catch((error) => {
      figure.classList.remove("drawn");
      throw error;
    });
  });
  Promise.all(drawn).then(() => document.documentElement.setAttribute("data-drawn", String(drawn.length)));
})();
