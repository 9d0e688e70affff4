/* The replay: recordings of all engines drawn over the exact motion. */
(() => {
  const player = document.getElementById("player");
  if (!player || !("DecompressionStream" in window)) return;
  const $ = (id) => document.getElementById("replay-" + id);
  const canvas = $("canvas"), pen = canvas.getContext("2d"), slider = $("time");
  const loaded = new Map(), people = JSON.parse($("who").textContent);
  const heads = inflate($("heads").textContent, "deflate").then((buffer) => JSON.parse(new TextDecoder().decode(buffer)));
  let show = null, playing = false, last = 0, clock = 0;

  /* One quantity after the other becomes frame by frame; sums along time undo the changes, and 16-bit integers wrap
     around as the packing did. */
  function framed(levels, width, changes) {
    const count = levels.length / width, out = new Int16Array(levels.length);
    for (let c = 0; c < width; c++)
      for (let k = 0; k < count; k++)
        out[k * width + c] = levels[c * count + k] + (changes && k ? out[(k - 1) * width + c] : 0);
    return out;
  }
  async function load(id) {
    if (loaded.has(id)) return loaded.get(id);
    const data = (await heads)[id], levelsOf = document.querySelector(`[data-replay="${CSS.escape(id)}"]`);
    const bytes = new Uint8Array(await inflate(levelsOf.textContent, "deflate")), half = bytes.length / 2;
    const levels = new Int16Array(half).map((_, i) => bytes[i] | (bytes[half + i] << 8));
    const d = data.dimension, parts = d === 2 ? 3 : 7, bodies = data.bodies.length;
    let at = 0, steps = 0;
    const take = (count) => levels.slice(at, (at += count));
    data.t = Array.from(take(data.count), (change) => (steps += change) * data.dt);
    data.series = data.series.map((one) => ({ frames: data.count, departure: null, ...people[one.who], ...one }));
    for (const one of data.series) {
      one.pose = framed(take(one.frames * bodies * parts), bodies * parts, true);
      one.frame = framed(take(one.contacts), 1, true);
      one.point = framed(take(one.contacts * d), d, false);
      one.impulse = framed(take(one.contacts * d), d, false);
      one.first = new Int32Array(one.frames + 1).fill(one.contacts);
      for (let c = one.contacts - 1; c >= 0; c--) one.first[one.frame[c]] = c;
      for (let k = one.frames - 1; k >= 0; k--) one.first[k] = Math.min(one.first[k], one.first[k + 1]);
      one.shown = !hidden.has(one.name);
    }
    data.exact = data.tracked === null ? null : framed(take(data.count * d), d, true);
    data.parts = parts;
    loaded.set(id, data);
    return data;
  }

  /* Pose of body i of a series at frame k as [position, rotation parts]. */
  function poseOf(data, one, k, i) {
    const d = data.dimension, n = data.parts, base = (Math.min(k, one.frames - 1) * data.bodies.length + i) * n;
    const place = [], turn = [];
    for (let c = 0; c < n; c++) (c < d ? place : turn).push(one.pose[base + c] * (c < d ? data.unit : data.angle));
    return [place, turn];
  }
  /* Exact pose of body i at frame k, where it is known: the tracked body, and every body if nothing may move. */
  function ghostOf(data, k, i) {
    const d = data.dimension, start = data.bodies[i].start;
    if (data.exact === null) return null;
    if (i === data.tracked) {
      const place = [];
      for (let c = 0; c < d; c++) place.push(data.exact[k * d + c] * data.unit);
      return [place, start.slice(d)];
    }
    return data.static ? [start.slice(0, d), start.slice(d)] : null;
  }
  function magnified(pose, ghost, times) {
    if (!ghost || times === 1) return pose;
    const place = pose[0].map((x, c) => ghost[0][c] + times * (x - ghost[0][c]));
    const turn = pose[1].length === 1 ? [ghost[1][0] + times * (pose[1][0] - ghost[1][0])] : pose[1];
    return [place, turn];
  }

  /* Outline of a body in the plane that is looked at: a circle or a convex polygon. */
  function rotated(q, v) {
    const norm = Math.hypot(...q) || 1, [w, x, y, z] = q.map((c) => c / norm);
    const t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])];
    return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2], v[2] + w * t[2] + x * t[1] - y * t[0]];
  }
  function hull(points) {
    const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    const cross = (o, a, b) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
    const half = (list) => {
      const out = [];
      for (const p of list) {
        while (out.length > 1 && cross(out.at(-2), out.at(-1), p) <= 0) out.pop();
        out.push(p);
      }
      return out.slice(0, -1);
    };
    return [...half(sorted), ...half(sorted.reverse())];
  }
  function corners(body, pose, plane) {
    const [place, turn] = pose, signs = [-1, 1];
    if (body.corners) {
      if (turn.length === 1) {
        const c = Math.cos(turn[0]), s = Math.sin(turn[0]);
        return body.corners.map(([x, y]) => [place[0] + c * x - s * y, place[1] + s * x + c * y]);
      }
      return hull(body.corners.map((p) => rotated(turn, p)).map((v) => plane.map((c) => place[c] + v[c])));
    }
    if (body.half.length === 2) {
      const c = Math.cos(turn[0]), s = Math.sin(turn[0]), [a, b] = body.half;
      return [[-a, -b], [a, -b], [a, b], [-a, b]].map(([x, y]) => [place[0] + c * x - s * y, place[1] + s * x + c * y]);
    }
    const all = [];
    for (const i of signs) for (const j of signs) for (const k of signs) {
      const v = rotated(turn, [i * body.half[0], j * body.half[1], k * body.half[2]]);
      all.push([place[plane[0]] + v[plane[0]], place[plane[1]] + v[plane[1]]]);
    }
    return hull(all);
  }

  function draw() {
    if (!show) return;
    const data = show, d = data.dimension, k = Number(slider.value);
    const plane = d === 2 ? [0, 1] : { xz: [0, 2], yz: [1, 2], xy: [0, 1] }[$("plane").value];
    const scale = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return; /* not laid out, as while the page closes */
    if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(height * scale);
    }
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, width, height);
    const upright = uprightOf(data, plane), low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    for (const a of [data.low, data.high]) for (const b of [data.low, data.high]) {
      const corner = upright([a[plane[0]], b[plane[1]]]);
      for (const c of [0, 1]) { low[c] = Math.min(low[c], corner[c]); high[c] = Math.max(high[c], corner[c]); }
    }
    const shown = data.series.filter((one) => one.shown);
    if ($("layout").value === "over") drawLane(data, shown, k, plane, low, high, [0, 0, width, height], "");
    else {
      /* Lanes stand beside each other where the motion is upright, and above each other where it is level. */
      const tall = (high[1] - low[1]) / (high[0] - low[0]) > 0.6, n = shown.length || 1;
      /* In several rows or columns where lanes would be narrower than their names or lower than two lines of text. */
      const most = Math.max(1, Math.floor(tall ? width / 96 : height / 56));
      const across = Math.ceil(n / Math.min(n, most)), along = Math.ceil(n / across);
      const [columns, rows] = tall ? [along, across] : [across, along], w = width / columns, h = height / rows;
      shown.forEach((one, i) => {
        const lane = [(i % columns) * w, Math.floor(i / columns) * h, w, h];
        drawLane(data, [one], k, plane, low, high, lane, one.name);
      });
    }
    $("clock").textContent = data.t[k].toFixed(3) + " s";
    slider.setAttribute("aria-valuetext", data.t[k].toFixed(3) + " seconds");
  }
  /* A scene may be posed with its floor level and gravity aslant: it is shown with gravity pointing down. */
  function uprightOf(data, plane) {
    const g = plane.map((c) => data.gravity[c]), size = Math.hypot(...g);
    if (!plane.includes(data.dimension - 1) || size === 0) return (p) => p;
    const c = -g[1] / size, s = g[0] / size;
    return (p) => [c * p[0] + s * p[1], c * p[1] - s * p[0]];
  }
  function drawLane(data, series, k, plane, low, high, [x0, y0, width, height], title) {
    const d = data.dimension, ink = getComputedStyle(document.body).color;
    /* At most a quarter of each side: what is drawn never has a negative size, however narrow the window. */
    const pad = Math.min(title ? 18 : 28, width / 4, height / 4);
    pen.save();
    pen.beginPath();
    pen.rect(x0, y0, width, height);
    pen.clip();
    pen.translate(x0, y0);
    /* A lane keeps its three lines of text free. */
    const top = title ? Math.min(50, height / 4) : pad;
    const zoom = Math.min((width - 2 * pad) / (high[0] - low[0]), (height - top - pad) / (high[1] - low[1]));
    const left = width / 2 - zoom * (low[0] + high[0]) / 2;
    const base = (height + top - pad) / 2 + zoom * (low[1] + high[1]) / 2;
    const upright = uprightOf(data, plane);
    const to = (p) => { const q = upright(p); return [left + zoom * q[0], base - zoom * q[1]]; };
    const path = (body, pose) => {
      pen.beginPath();
      if (body.type === "ball") {
        const [x, y] = to([pose[0][plane[0]], pose[0][plane[1]]]), r = zoom * body.radius;
        const spoke = upright(d === 2 ? [Math.cos(pose[1][0]), Math.sin(pose[1][0])] : plane.map((c) => rotated(pose[1], [1, 0, 0])[c]));
        pen.arc(x, y, r, 0, 2 * Math.PI);
        pen.moveTo(x, y);
        pen.lineTo(x + r * spoke[0], y - r * spoke[1]);
      } else {
        corners(body, pose, plane).map(to).forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
        pen.closePath();
      }
    };
    for (const face of data.fixed) if (face.type === "face") drawFace(face, plane, to, ink);
    const times = Number($("magnify").value);
    pen.fillStyle = ink;
    pen.globalAlpha = 0.16;
    data.bodies.forEach((body, i) => {
      const ghost = ghostOf(data, k, i);
      if (ghost) { path(body, ghost); pen.fill(); }
    });
    pen.globalAlpha = 1;
    for (const one of series) {
      pen.strokeStyle = one.colour;
      pen.lineWidth = 1.8;
      pen.setLineDash(one.dash);
      data.bodies.forEach((body, i) => {
        path(body, magnified(poseOf(data, one, k, i), ghostOf(data, k, i), times));
        pen.stroke();
      });
      pen.setLineDash([]);
      if ($("arrows").checked) drawArrows(data, one, k, plane, to, Math.min(width, height) / 3);
    }
    drawLabels(ink, zoom, height, title, series);
    pen.restore();
  }
  function drawFace(face, plane, to, ink) {
    const n = plane.map((c) => face.normal[c]), size = Math.hypot(...n);
    if (size < 0.5) return;
    const on = [n[0] * face.offset / size ** 2, n[1] * face.offset / size ** 2], far = 1e3;
    const [a, b] = [to([on[0] - far * n[1], on[1] + far * n[0]]), to([on[0] + far * n[1], on[1] - far * n[0]])];
    pen.strokeStyle = ink;
    pen.globalAlpha = 0.55;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(...a);
    pen.lineTo(...b);
    pen.stroke();
    pen.globalAlpha = 1;
  }
  /* Impulses of this frame, and fading ones of the frames before for pairs that have let go since. */
  function drawArrows(data, one, k, plane, to, longest) {
    const d = data.dimension, fade = 8;
    pen.strokeStyle = pen.fillStyle = one.colour;
    for (let j = Math.min(k, one.frames - 1); j >= Math.max(0, k - fade); j--) {
      const from = one.first[j], until = one.first[j + 1];
      for (let c = from; c < until; c++) {
        const [x, y] = to(plane.map((axis) => one.point[c * d + axis] * data.place));
        const vector = uprightOf(data, plane)(plane.map((axis) => one.impulse[c * d + axis] * data.arrow));
        const length = Math.hypot(...vector);
        if (length * longest < 3) continue;
        const ex = x + vector[0] * longest, ey = y - vector[1] * longest, turn = Math.atan2(ey - y, ex - x);
        pen.globalAlpha = 0.85 * (1 - (k - j) / (fade + 1));
        pen.lineWidth = 2;
        pen.beginPath();
        pen.moveTo(x, y);
        pen.lineTo(ex, ey);
        pen.stroke();
        pen.beginPath();
        pen.moveTo(ex + 3 * Math.cos(turn), ey + 3 * Math.sin(turn));
        pen.lineTo(ex - 7 * Math.cos(turn - 0.45), ey - 7 * Math.sin(turn - 0.45));
        pen.lineTo(ex - 7 * Math.cos(turn + 0.45), ey - 7 * Math.sin(turn + 0.45));
        pen.fill();
      }
      if (until > from) break;
    }
    pen.globalAlpha = 1;
  }
  /* Name of a lane, and whether its engine has left the tolerance; else a ruler. */
  function drawLabels(ink, zoom, height, title, series) {
    pen.font = "12px system-ui, sans-serif";
    pen.fillStyle = pen.strokeStyle = ink;
    if (title) {
      const gone = series[0].departure !== null && series[0].departure <= show.t[Number(slider.value)] + 1e-9;
      pen.fillStyle = series[0].colour;
      pen.fillRect(6, 7, 9, 9);
      pen.fillStyle = ink;
      [...title.split("/"), ...(gone ? ["out of tolerance"] : [])].forEach((line, i) => pen.fillText(line, 20, 16 + 15 * i));
      return;
    }
    const length = 10 ** Math.floor(Math.log10(140 / zoom)), pixels = zoom * length;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(12, height - 12.5);
    pen.lineTo(12 + pixels, height - 12.5);
    pen.moveTo(12.5, height - 16);
    pen.lineTo(12.5, height - 9);
    pen.moveTo(12 + pixels, height - 16);
    pen.lineTo(12 + pixels, height - 9);
    pen.stroke();
    pen.fillText(length + " m", 12, height - 20);
  }

  function tick(now) {
    if (!playing) return;
    clock += ((now - last) / 1000) * Number($("speed").value);
    last = now;
    const t = show.t;
    if (clock >= t.at(-1)) clock = 0;
    let k = Number(slider.value);
    if (t[k] > clock) k = 0;
    while (k + 1 < t.length && t[k + 1] <= clock) k++;
    slider.value = k;
    draw();
    requestAnimationFrame(tick);
  }
  function play(on) {
    playing = on;
    $("play").textContent = on ? "Pause" : "Play";
    $("play").setAttribute("aria-pressed", String(on));
    if (on) { last = performance.now(); clock = show.t[Number(slider.value)]; requestAnimationFrame(tick); }
  }
  function go(k) {
    slider.value = k;
    clock = show.t[Number(slider.value)];
    draw();
  }

  function listSeries() {
    const box = $("series");
    $$("label", box).forEach((old) => old.remove());
    for (const one of show.series) {
      const label = document.createElement("label"), check = document.createElement("input"), swatch = document.createElement("span");
      check.type = "checkbox";
      check.checked = one.shown;
      check.addEventListener("change", () => { one.shown = check.checked; draw(); });
      label.classList.toggle("off", hidden.has(one.name));
      swatch.className = "swatch";
      swatch.style.background = one.colour;
      label.append(check, swatch, document.createTextNode(one.name));
      box.append(label);
    }
  }
  function listJumps() {
    const box = $("jumps");
    box.replaceChildren();
    const gone = show.series.filter((one) => one.departure !== null).sort((a, b) => a.departure - b.departure);
    const head = document.createElement("span");
    head.textContent = gone.length ? "Jump to where an engine first leaves the tolerance:" : "Every engine stays within the tolerance.";
    box.append(head);
    for (const one of gone) {
      const jump = document.createElement("button");
      jump.type = "button";
      jump.textContent = `${one.name} at ${one.departure.toFixed(3)} s`;
      jump.addEventListener("click", () => {
        play(false);
        const k = show.t.findIndex((t) => t >= one.departure - 1e-9);
        go(k < 0 ? show.t.length - 1 : k);
      });
      box.append(jump);
    }
  }
  /* A frame after the first engine leaves the tolerance, where that is seen; the start if none does. */
  function parted() {
    const gone = show.series.map((one) => one.departure).filter((t) => t !== null);
    return gone.length ? Math.max(0, show.t.findIndex((t) => t >= Math.min(...gone) + 0.1)) : 0;
  }
  async function choose(id, frame = 0) {
    play(false);
    show = await load(id);
    remember("scene", id === $("scene").options[0].value ? "" : id);
    slider.max = show.t.length - 1;
    $("plane-label").hidden = show.dimension === 2;
    listSeries();
    listJumps();
    go(Math.min(frame ?? parted(), show.t.length - 1));
  }

  player.hidden = false;
  /* Beside each other every engine is seen whole, where there is room for it. */
  if (canvas.clientWidth >= 700) $("layout").value = "beside";
  canvas.tabIndex = 0;
  $("scene").addEventListener("change", () => choose($("scene").value));
  $("play").addEventListener("click", () => play(!playing));
  slider.addEventListener("input", () => { clock = show.t[Number(slider.value)]; draw(); });
  for (const id of ["layout", "magnify", "plane", "arrows"]) $(id).addEventListener("change", draw);
  player.addEventListener("keydown", (event) => {
    if (event.target !== canvas && event.target !== slider) return;
    const k = Number(slider.value), own = event.target === slider;
    if (event.key === " ") play(!playing);
    else if (!own && event.key === "ArrowRight") go(k + 1);
    else if (!own && event.key === "ArrowLeft") go(k - 1);
    else if (!own && event.key === "Home") go(0);
    else if (!own && event.key === "End") go(show.t.length - 1);
    else return;
    event.preventDefault();
  });
  slider.addEventListener("change", () => remember("t", slider.value));
  addEventListener("filtered", () => {
    for (const data of loaded.values()) for (const one of data.series) one.shown = !hidden.has(one.name);
    if (show) { listSeries(); draw(); }
  });
  addEventListener("resize", draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  for (const id of ["layout", "magnify", "plane"]) {
    if (view.has(id)) $(id).value = view.get(id);
    $(id).addEventListener("change", () => remember(id, $(id).value));
  }
  if (view.has("scene")) $("scene").value = view.get("scene");
  choose($("scene").value || $("scene").options[0].value, view.has("t") ? Number(view.get("t")) : null);
})();
