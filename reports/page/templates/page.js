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
  const point = event.target.closest?.(".canvas [role='graphics-symbol'][aria-label]");
  if (point && !point.getAttribute("aria-roledescription")?.includes("axis")) {
    showHint(point.getAttribute("aria-label"), event.clientX, event.clientY);
  } else hint.hidden = true;
});
document.addEventListener("keydown", (event) => { if (event.key === "Escape") hint.hidden = true; });

/* Copy buttons stand beside every command; without a clipboard they select the text. */
for (const button of $$("button.copy")) {
  button.hidden = false;
  button.addEventListener("click", async () => {
    const code = button.previousElementSibling;
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

/* A link into closed details opens them. */
function openTarget() {
  const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  for (let node = target; node; node = node.parentElement) if (node.tagName === "DETAILS") node.open = true;
  target?.scrollIntoView();
}
addEventListener("hashchange", openTarget);
if (location.hash) openTarget();
