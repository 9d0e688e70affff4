"use strict";
/* Filters, kept behind a "?" in the address' fragment: #moved?scene=stack&verdict=moved. A file has no other place. */
const form = document.getElementById("filter");
const shown = document.getElementById("shown");
const fields = ["engine", "scene", "verdict", "release"];
form.hidden = false;
form.addEventListener("submit", (event) => event.preventDefault());

function wanted(node, choice) {
  const data = node.dataset;
  if (choice.engine && data.engine !== choice.engine) return false;
  if (choice.scene && data.scene !== choice.scene) return false;
  if (choice.verdict === "moved" && !data.moved) return false;
  if (choice.verdict && choice.verdict !== "moved" && data.state && data.state !== choice.verdict) return false;
  const releases = (data.releases ?? data.release ?? "").split(" ");
  return !choice.release || releases.includes(choice.release);
}

function apply() {
  const choice = Object.fromEntries(fields.map((name) => [name, form.elements[name].value]));
  let count = 0;
  for (const node of document.querySelectorAll(".panel, #moved tbody tr")) {
    const on = wanted(node, choice);
    node.classList.toggle("off", !on);
    if (on && node.classList.contains("panel")) count += 1;
  }
  for (const section of document.querySelectorAll("section[class^='e-']")) {
    section.classList.toggle("off", !section.querySelector(".panel:not(.off)"));
  }
  shown.textContent = `${count} series`;
  return choice;
}

function remember() {
  const view = new URLSearchParams(Object.entries(apply()).filter(([, value]) => value));
  const anchor = location.hash.slice(1).split("?")[0];
  const text = view.toString();
  history.replaceState(null, "", anchor || text ? "#" + anchor + (text ? "?" + text : "") : location.pathname);
}

function restore() {
  const [anchor, query] = location.hash.slice(1).split("?");
  if (query !== undefined || !anchor) {
    const view = new URLSearchParams(query ?? "");
    for (const name of fields) form.elements[name].value = view.get(name) ?? "";
  }
  apply();
  const target = anchor && document.getElementById(decodeURIComponent(anchor));
  if (target) {
    if (target.classList.contains("off")) {
      for (const name of fields) form.elements[name].value = "";
      apply();
    }
    for (let node = target; node; node = node.parentElement) if (node.tagName === "DETAILS") node.open = true;
    target.scrollIntoView();
  }
}

form.addEventListener("change", remember);
addEventListener("hashchange", restore);
restore();
