"use strict";
// Unpacks plotly.js, draws the 3-D scene, and names it for the tests and for screen readers.
(async () => {
  const space = document.getElementById("space");
  if (!space) return;
  try {
    const unpacked = (name) => {
      const packed = Uint8Array.from(atob(document.getElementById(name).textContent), (c) => c.charCodeAt(0));
      return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
    };
    const script = document.createElement("script");
    script.text = await unpacked("plotly");
    document.head.appendChild(script);
    const far = space.clientWidth < 600 ? 1.55 : 1; // so that the labels of the axes are whole on a narrow screen
    const axis = (title) => ({ title: { text: title }, backgroundcolor: "#f4f6f8", showbackground: true, tickformat: "d" });
    const layout = {
      margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: true, legend: { orientation: "h", y: 1, yanchor: "bottom", font: { size: 13 } },
      scene: { aspectmode: "data", camera: { eye: { x: 1.25 * far, y: -1.35 * far, z: 0.8 * far }, center: { x: 0, y: 0, z: -0.2 } }, xaxis: axis("x [mm]"), yaxis: axis("y [mm]"), zaxis: axis("z [mm]") },
    };
    space.textContent = "";
    await Plotly.newPlot(space, JSON.parse(await unpacked("traces")), layout, { responsive: true, displaylogo: false });
    space.dataset.drawn = "yes";
  } catch (error) {
    space.textContent = "This browser cannot draw the 3-D scene (" + error + "). The picture below shows the search from above.";
    space.dataset.drawn = "no";
  }
})();
