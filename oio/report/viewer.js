"use strict";
// Unpacks plotly.js, draws the 3-D scene, and names it for the tests and for screen readers.
(async () => {
  const space = document.getElementById("space");
  if (!space) return;
  try {
    const packed = Uint8Array.from(atob(document.getElementById("plotly").textContent), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = document.createElement("script");
    script.text = await new Response(stream).text();
    document.head.appendChild(script);
    const axis = (title) => ({ title: { text: title }, backgroundcolor: "#f4f6f8", showbackground: true });
    const layout = {
      margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: true, legend: { orientation: "h", y: 1, yanchor: "bottom", font: { size: 13 } },
      scene: { aspectmode: "data", camera: { eye: { x: 1.4, y: -1.5, z: 0.9 }, center: { x: 0, y: 0, z: -0.15 } }, xaxis: axis("x [mm]"), yaxis: axis("y [mm]"), zaxis: axis("z [mm]") },
    };
    space.textContent = "";
    await Plotly.newPlot(space, JSON.parse(document.getElementById("traces").textContent), layout, { responsive: true, displaylogo: false });
    space.dataset.drawn = "yes";
  } catch (error) {
    space.textContent = "This browser cannot draw the 3-D scene (" + error + "). The picture below shows the search from above.";
    space.dataset.drawn = "no";
  }
})();
