/* The bounce explorer: h_n = e^(2n) h0 for the e of the slider, and what each engine measured there. */
(() => {
  const live = document.getElementById("explorer-live"), source = document.getElementById("explorer-data");
  if (!live || !source) return;
  const data = JSON.parse(source.textContent), plot = document.getElementById("explorer-plot");
  const slider = document.getElementById("explorer-e"), logarithmic = document.getElementById("explorer-log");
  const box = { left: 64, right: 744, top: 14, bottom: 312 }, bounces = 8, lowest = 1e-4;
  /* As many units as there are pixels, so that text keeps its size on a narrow screen. */
  function fit() {
    const width = Math.max(260, Math.min(760, live.clientWidth || 760));
    box.right = width - 16;
    plot.setAttribute("viewBox", `0 0 ${width} 360`);
  }
  const x = (n) => box.left + (n / bounces) * (box.right - box.left);
  const share = (h) => (logarithmic.checked ? 1 - Math.log10(Math.max(h, lowest)) / Math.log10(lowest) : h);
  const y = (h) => box.bottom - Math.min(1.02, Math.max(0, share(h))) * (box.bottom - box.top);
  function put(name, attributes, text) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    plot.append(made);
    return made;
  }
  function curve(e, opacity, width) {
    const points = Array.from({ length: bounces + 1 }, (_, n) => `${x(n)},${y(e ** (2 * n))}`);
    put("polyline", { points: points.join(" "), fill: "none", stroke: "currentColor", "stroke-opacity": opacity, "stroke-width": width });
  }
  /* Right of the falling curve, between the first two clouds of markers and above the second; drawn after them. */
  function label(e) {
    const place = { x: x(1.5), y: (y(e ** 2) + y(e ** 4)) / 2 - 8, "font-size": 12 };
    put("text", { ...place, fill: "currentColor", class: "halo" }, `e = ${e}`);
  }
  const shapes = {
    circle: "M-4.5,0a4.5,4.5 0 1,0 9,0a4.5,4.5 0 1,0 -9,0", square: "M-4,-4h8v8h-8z", diamond: "M0,-6 6,0 0,6 -6,0z",
    "triangle-up": "M0,-5.5 5.5,4.5h-11z", "triangle-down": "M0,5.5 5.5,-4.5h-11z", cross: "M-2,-5h4v3h3v4h-3v3h-4v-3h-3v-4h3z",
  };
  function axes() {
    const ticks = logarithmic.checked ? [1, 0.1, 0.01, 0.001, 0.0001] : [0, 0.2, 0.4, 0.6, 0.8, 1];
    for (const h of ticks) {
      put("path", { d: `M${box.left} ${y(h)}H${box.right}`, stroke: "currentColor", "stroke-opacity": 0.13 });
      put("text", { x: box.left - 8, y: y(h) + 4, "text-anchor": "end", fill: "currentColor", "font-size": 12 }, h);
    }
    for (let n = 0; n <= bounces; n++) put("text", { x: x(n), y: box.bottom + 18, "text-anchor": "middle", fill: "currentColor", "font-size": 12 }, n);
    put("text", { x: (box.left + box.right) / 2, y: box.bottom + 38, "text-anchor": "middle", fill: "currentColor", "font-size": 12.5 }, "bounce n");
    const mid = (box.top + box.bottom) / 2;
    put("text", { x: 16, y: mid, transform: `rotate(-90 16 ${mid})`, "text-anchor": "middle", fill: "currentColor", "font-size": 12.5 }, "apex height h / h0");
  }
  function points(e) {
    const near = data.measured.find((m) => Math.abs(m - e) < 0.006);
    if (near === undefined) return null;
    const own = data.series.filter((one) => one.heights[String(near)] && !hidden.has(one.name));
    own.forEach((one, k) => one.heights[String(near)].forEach((h, i) => {
      if (i >= bounces) return;
      /* Side by side, so that equal answers do not hide each other. */
      const at = x(i + 1) + (k - (own.length - 1) / 2) * Math.min(5.5, (0.9 * (x(1) - x(0))) / own.length);
      const point = put("path", { d: shapes[one.shape], transform: `translate(${at},${y(h)})`, fill: one.hollow ? "transparent" : one.colour, stroke: one.colour, "stroke-width": 1.5, role: "graphics-symbol" });
      point.setAttribute("aria-label", `${one.name}: h${i + 1} = ${h} h0, exact ${(near ** (2 * i + 2)).toPrecision(4)}`);
    }));
    return near;
  }
  function draw() {
    const e = Number(slider.value);
    document.getElementById("explorer-value").textContent = e.toFixed(2);
    plot.replaceChildren();
    fit();
    axes();
    for (const faint of data.faint) curve(faint, 0.22, 1.5);
    curve(e, 0.85, 2);
    const near = points(e), list = data.measured.join(", ");
    for (const each of [...data.faint.filter((faint) => faint !== e), e]) label(each);
    const said = e === 0 ? "The ball does not rise again." : e === 1 ? "Every bounce is as high as the last." :
      `After one bounce ${(100 * e * e).toPrecision(3)} % of the height is left, after five ${(100 * e ** 10).toPrecision(3)} %; ` +
      `half of it is gone after ${(Math.log(0.5) / (2 * Math.log(e))).toPrecision(2)} bounces.`;
    document.getElementById("explorer-says").textContent = said +
      (near === undefined || near === null ? ` Engines were measured at e = ${list}.` : ` Points: engines at e = ${near}.`);
  }
  live.hidden = false;
  document.getElementById("explorer-still").hidden = true;
  if (view.has("e")) slider.value = view.get("e");
  slider.addEventListener("input", draw);
  slider.addEventListener("change", () => remember("e", slider.value));
  addEventListener("filtered", draw);
  addEventListener("resize", draw);
  logarithmic.addEventListener("change", draw);
  for (const preset of $$(".preset", live)) preset.addEventListener("click", () => { slider.value = preset.dataset.e; draw(); });
  draw();
})();
