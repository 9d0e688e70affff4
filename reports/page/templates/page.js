"use strict";
/* What every part of the page shares: hints over chart points, copy buttons, links that open what they lead to. */
const $$ = (selector, root = document) => [...root.querySelectorAll(selector)];

/* Hints: a point's label, where the pointer is. */
const hint = document.getElementById("hint");
function showHint(text, x, y) {
  hint.textContent = text;
  hint.hidden = false;
  const box = hint.getBoundingClientRect();
  hint.style.left = Math.max(4, Math.min(x + 14, innerWidth - box.width - 6)) + "px";
  hint.style.top = (y + 18 + box.height > innerHeight ? y - box.height - 10 : y + 18) + "px";
}
document.addEventListener("pointerover", (event) => {
  const point = event.target.closest?.(".canvas [data-is]");
  if (point) {
    showHint(point.dataset.is, event.clientX, event.clientY);
  } else hint.hidden = true;
});
document.addEventListener("keydown", (event) => { if (event.key === "Escape") hint.hidden = true; });

/* Copy buttons stand beside every command; without a clipboard they select the text. */
for (const command of $$(".cmd")) {
  const code = command.firstElementChild, button = command.appendChild(document.createElement("button"));
  Object.assign(button, { type: "button", className: "copy", textContent: "copy" });
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(code.textContent);
      button.textContent = "copied";
    } catch {
      getSelection().selectAllChildren(code);
      button.textContent = "selected";
    }
    setTimeout(() => { button.textContent = "copy"; }, 1500);
  });
}

/* What is shown stands behind a "?" in the address' fragment: #speed?hide=engine%2Fprofile&t=34. A file has no other place. */
const view = new URLSearchParams(location.hash.split("?")[1] ?? "");
function remember(name, value) {
  if (value === null || value === "") view.delete(name);
  else view.set(name, value);
  const text = view.toString(), anchor = location.hash.slice(1).split("?")[0];
  history.replaceState(null, "", "#" + anchor + (text ? "?" + text : ""));
}

/* A link into closed details opens them. */
function openTarget() {
  const target = document.getElementById(decodeURIComponent(location.hash.slice(1).split("?")[0]));
  for (let node = target; node; node = node.parentElement) if (node.tagName === "DETAILS") node.open = true;
  target?.scrollIntoView();
}
addEventListener("hashchange", () => {
  openTarget();
  if (view.size && !location.hash.includes("?")) remember("", "");
});
if (location.hash) openTarget();

/* Filter: engines and profiles that are switched off leave tables, charts and the replay. */
const hidden = new Set((view.get("hide") ?? "").split(" ").filter(Boolean));
const filter = document.getElementById("filter"), boxes = $$("input", filter ?? document.createElement("p"));
const names = boxes.map((box) => box.value);
const nameIn = (text) => names.find((name) => text === name || text.startsWith(name + ",") || text.startsWith(name + ":"));
function applyFilter() {
  for (const box of boxes) box.checked = !hidden.has(box.value);
  for (const node of $$("[data-who]")) node.classList.toggle("off", hidden.has(node.dataset.who));
  for (const head of $$("[data-engine]")) {
    const own = $$(".sub", head.closest("thead")).map((sub) => sub.dataset.who);
    const shown = own.filter((name) => name.startsWith(head.dataset.engine + "/") && !hidden.has(name)).length;
    head.classList.toggle("off", shown === 0);
    if (shown) head.colSpan = shown;
  }
  dispatchEvent(new Event("filtered"));
}
if (filter && names.length > 1) {
  filter.hidden = false;
  /* Every row, column and mark that belongs to one engine and profile gets its name, once. */
  for (const who of $$("main .who")) {
    const name = who.textContent.trim(), row = who.closest("tbody tr"), item = who.closest(".key li");
    const owner = row && who.closest("th") === row.cells[0] ? row : item;
    if (owner && names.includes(name)) owner.dataset.who = name;
  }
  for (const table of $$("table.matrix")) {
    $$(".sub", table).forEach((head, k) => { for (const row of table.tBodies[0].rows) row.cells[k + 1].dataset.who = head.dataset.who; });
  }
  for (const table of $$("table:not(.matrix)")) {
    [...(table.tHead?.rows[0]?.cells ?? [])].forEach((cell, k) => {
      const name = cell.textContent.trim();
      if (names.includes(name)) for (const row of table.rows) if (row.cells[k]) row.cells[k].dataset.who = name;
    });
  }
  for (const mark of $$(".canvas [data-is]")) {
    const name = nameIn(mark.dataset.is);
    if (name) mark.dataset.who = name;
  }
  filter.addEventListener("change", (event) => {
    if (event.target.checked) hidden.delete(event.target.value);
    else hidden.add(event.target.value);
    remember("hide", [...hidden].join(" "));
    applyFilter();
  });
  document.getElementById("filter-all").addEventListener("click", () => { hidden.clear(); remember("hide", ""); applyFilter(); });
  const link = document.getElementById("copy-link");
  link.addEventListener("click", async () => {
    try { await navigator.clipboard.writeText(location.href); link.textContent = "copied"; } catch { link.textContent = "it is in the address bar"; }
    setTimeout(() => { link.textContent = "copy link to this view"; }, 1500);
  });
  applyFilter();
}

/* Taking away: every table as CSV, every plot as SVG and PNG. */
function save(name, content, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
function button(text, label, action) {
  const made = document.createElement("button");
  made.type = "button";
  made.className = "save";
  made.textContent = text;
  made.setAttribute("aria-label", label);
  made.addEventListener("click", action);
  return made;
}
const fileName = (text) => (text || "table").toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "");
function csvOf(table) {
  const textOf = (cell) => cell.textContent.replace(/\s+/g, " ").replace(/ copy$/, "").trim();
  const quoted = (text) => /[",\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text;
  // One line of names and lines of equal length, as readers of CSV want them: a cell that spans rows stands in each.
  const heads = table.tHead ? table.tHead.rows.length : 0, grid = [];
  $$("tr", table).forEach((row, r) => {
    let c = 0;
    for (const cell of row.cells) {
      while (grid[r]?.[c] !== undefined) c += 1;
      for (let i = 0; i < cell.rowSpan; i += 1)
        for (let j = 0; j < cell.colSpan; j += 1) (grid[r + i] ??= [])[c + j] = j === 0 || r < heads ? textOf(cell) : "";
      c += cell.colSpan;
    }
  });
  const width = Math.max(0, ...grid.map((row) => row.length)), columns = [...Array(width).keys()];
  const name = (c) => [...new Set(grid.slice(0, heads).map((row) => row[c] ?? ""))].filter(Boolean).join("/");
  // What stands above a group of rows is a column before the others.
  const lines = [], rows = $$("tr", table);
  let group = [];
  for (let r = heads; r < grid.length; r += 1) {
    const line = columns.map((c) => grid[r][c] ?? "");
    if (rows[r].cells[0].scope === "rowgroup") group = [line[0]];
    else lines.push([...group, ...line]);
  }
  return [...(heads ? [[...group.map(() => "group"), ...columns.map(name)]] : []), ...lines].map((row) => row.map(quoted).join(",")).join("\n") + "\n";
}
for (const region of $$(".scroll")) {
  const table = region.querySelector("table"), label = region.getAttribute("aria-label");
  region.after(button("CSV", "Save as CSV: " + label, () => save(fileName(label) + ".csv", csvOf(table), "text/csv")));
}
function standalone(svg) {
  const copy = svg.cloneNode(true), style = getComputedStyle(document.body);
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.setAttribute("color", style.color);
  copy.setAttribute("font-family", style.fontFamily);
  const paper = document.createElementNS("http://www.w3.org/2000/svg", "rect");
  paper.setAttribute("width", "100%");
  paper.setAttribute("height", "100%");
  paper.setAttribute("fill", style.backgroundColor);
  copy.prepend(paper);
  /* A picture that is taken away says what it is: its title above it, and engines and profiles below it. */
  const [left, top, width, height] = svg.getAttribute("viewBox").split(/[\s,]+/).map(Number);
  const key = svg.closest("section, .shot")?.querySelector(".key");
  const say = (text, x, y, weight = 400) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", "text");
    for (const [name, value] of Object.entries({ x, y, fill: "currentColor", "font-size": 12, "font-weight": weight })) made.setAttribute(name, value);
    made.textContent = text;
    copy.append(made);
  };
  const marks = $$("[data-is]", svg), names = new Set(marks.map((mark) => mark.dataset.is.split(/[,:]/)[0]));
  const shown = svg.closest(".talk") ? [] : $$("li", key ?? svg).map((item) => item.textContent.trim()).filter((name) => names.has(name));
  /* As many columns as fit: a letter is at most 7 wide, and its mark stands before each name. */
  const wide = 26 + 7 * Math.max(0, ...shown.map((name) => name.length)), columns = Math.max(1, Math.floor(width / wide));
  shown.forEach((name, k) => {
    const x = left + 12 + (k % columns) * wide, y = top + height + 16 + 16 * Math.floor(k / columns);
    const mark = marks.find((one) => one.dataset.is.startsWith(name + ",") && one.hasAttribute("transform")) ?? marks.find((one) => one.dataset.is.startsWith(name));
    const point = mark.cloneNode();
    if (point.hasAttribute("transform")) point.setAttribute("transform", `translate(${x},${y - 4})`);
    else point.setAttribute("d", `M${x - 6},${y - 4}h12`);
    point.removeAttribute("data-is");
    if (!point.hasAttribute("fill")) point.setAttribute("fill", "none");
    copy.append(point);
    say(name, x + 10, y);
  });
  say(svg.getAttribute("aria-label"), left + 6, top - 8, 600);
  const tall = height + 32 + 16 * Math.ceil(shown.length / columns);
  const across = Math.max(width, wide, 20 + 7 * svg.getAttribute("aria-label").length);
  copy.setAttribute("viewBox", [left, top - 24, across, tall].join(" "));
  copy.setAttribute("width", across);
  copy.setAttribute("height", tall);
  for (const [name, value] of [["x", left], ["y", top - 24]]) paper.setAttribute(name, value);
  return new XMLSerializer().serializeToString(copy);
}
function savePng(svg, name) {
  const picture = new Image();
  picture.addEventListener("load", () => {
    const canvas = document.createElement("canvas");
    canvas.width = 2 * picture.width;
    canvas.height = 2 * picture.height;
    canvas.getContext("2d").drawImage(picture, 0, 0, canvas.width, canvas.height);
    canvas.toBlob((blob) => save(name, blob));
  });
  picture.src = "data:image/svg+xml;charset=utf-8," + encodeURIComponent(standalone(svg));
}
for (const figure of $$("figure.plot")) {
  const svg = figure.querySelector("svg"), title = svg.getAttribute("aria-label"), name = fileName(title);
  const box = document.createElement("span");
  box.className = "saves";
  box.append(
    button("SVG", "Save as SVG: " + title, () => save(name + ".svg", standalone(svg), "image/svg+xml")),
    button("PNG", "Save as PNG: " + title, () => savePng(svg, name + ".png")),
  );
  figure.append(box);
}

/* A field of a table of errors gives its command. */
document.addEventListener("click", async (event) => {
  const cell = event.target.closest?.(".grid tbody td");
  const line = cell?.parentElement;
  if (!line || cell.cellIndex < 3 || !cell.textContent) return;
  const head = line.closest("table").tHead.rows[0].cells[cell.cellIndex].textContent.split("/");
  const { run: start, end } = line.closest("table").dataset;
  const own = line.dataset.run ?? line.cells[0].textContent.trim().split(" ").join(" --param ");
  const command = [start, own, end].filter(Boolean).join(" ").replace("--engine @", "--engine " + head[0]).replace("--profile @", "--profile " + head[1]);
  let said = command;
  try { await navigator.clipboard.writeText(command); said = "copied: " + command; } catch { /* shown instead */ }
  showHint(said, event.clientX, event.clientY);
});

/* All rows as CSV, from the columns that are inside the page; a spreadsheet must not take text for a formula. */
const asCsv = document.getElementById("as-csv");
if (asCsv && "DecompressionStream" in window) {
  asCsv.hidden = false;
  asCsv.querySelector("button").addEventListener("click", async () => {
    const link = document.querySelector("a[download='rows.json.gz']");
    const columns = JSON.parse(await inflate(link.href.split(",")[1], "gzip").then((buffer) => new TextDecoder().decode(buffer)));
    const names = Object.keys(columns), quoted = (value) => {
      const text = typeof value === "string" && /^[=+\-@\t\r]/.test(value) ? "'" + value : String(value ?? "");
      return /[",\r\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text;
    };
    const lines = (columns[names[0]] ?? []).map((_, k) => names.map((name) => quoted(columns[name][k])).join(","));
    save("rows.csv", [names.join(","), ...lines].join("\n") + "\n", "text/csv");
  });
}
async function inflate(base64, format) {
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream(format));
  return new Response(stream).arrayBuffer();
}
